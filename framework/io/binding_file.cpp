#include "framework/io/binding_file.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "framework/error.hpp"
#include "framework/io/input_file.hpp"
#include "framework/io/output_file.hpp"

namespace halfgrad {

using nlohmann::json;

namespace {

static_assert(std::endian::native == std::endian::little, "the tables of .hgb files are little-endian");

constexpr int format_version = 4;

// Tables are byte strings of their numbers as they stand in memory.
template <class T>
json packed(const T* values, std::size_t count) {
  static_assert(std::is_trivially_copyable_v<T>);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(values);
  return json::binary(json::binary_t::container_type(bytes, bytes + count * sizeof(T)));
}
template <class T>
json packed(const std::vector<T>& values) {
  return packed(values.data(), values.size());
}

// Reads what packed() wrote, with the file's name in every message.
class TableReader {
 public:
  TableReader(std::string file, const json& object) : file_(std::move(file)), object_(object) {}

  template <class... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    raise("{}: the binding is damaged: {}", file_, fmt::format(format, std::forward<Args>(args)...));
  }
  const json& at(const char* key) const {
    const auto found = object_.find(key);
    if (found == object_.end()) fail("\"{}\" is missing", key);
    return *found;
  }
  TableReader object(const char* key) const {
    if (!at(key).is_object()) fail("\"{}\" is no object", key);
    return {file_, at(key)};
  }
  template <class T>
  std::vector<T> table(const char* key) const {
    const json& value = at(key);
    if (!value.is_binary() || value.get_binary().size() % sizeof(T) != 0) fail("\"{}\" is no table", key);
    std::vector<T> result(value.get_binary().size() / sizeof(T));
    if (!result.empty()) std::memcpy(result.data(), value.get_binary().data(), value.get_binary().size());
    return result;
  }
  template <class T>
  std::vector<T> table(const char* key, std::size_t size) const {
    std::vector<T> result = table<T>(key);
    if (result.size() != size) fail("\"{}\" has {} entries, expected {}", key, result.size(), size);
    return result;
  }
  std::vector<double> weights(const char* key, std::size_t size) const {
    std::vector<double> result = table<double>(key, size);
    if (!std::ranges::all_of(result, [](double value) { return std::isfinite(value); }))
      fail("\"{}\" is not finite", key);
    return result;
  }
  void check_range(const char* key, const std::vector<Index>& values, Index least, Index end) const {
    for (Index value : values)
      if (value < least || value >= end) fail("\"{}\" holds {}, expected {} to {}", key, value, least, end - 1);
  }
  // Ends of `count` rows that cover `total` entries.
  std::vector<Offset> offsets(const char* key, std::size_t count, std::size_t total) const {
    std::vector<Offset> result = table<Offset>(key, count + 1);
    if (result.front() != 0 || result.back() != static_cast<Offset>(total) || !std::ranges::is_sorted(result))
      fail("\"{}\" does not ascend from 0 to {}", key, total);
    return result;
  }

 private:
  std::string file_;
  const json& object_;
};

json write_embedding(const Embedding& embedding) {
  std::vector<Index> points;
  std::vector<double> distances, offsets;
  for (const OutsidePoint& outside : embedding.outside) {
    points.push_back(outside.point);
    distances.push_back(outside.distance);
    for (int k = 0; k < embedding.gdim; ++k) offsets.push_back(outside.offset[k]);
  }
  return {{"gdim", embedding.gdim},
          {"cells", packed(embedding.cells)},
          {"local", packed(embedding.local.data(), static_cast<std::size_t>(embedding.local.size()))},
          {"status", packed(embedding.status)},
          {"outside_points", packed(points)},
          {"outside_distances", packed(distances)},
          {"outside_offsets", packed(offsets)}};
}

Embedding read_embedding(const TableReader& in, const BindingSizes& sizes) {
  Embedding embedding;
  embedding.gdim = sizes.gdim;
  if (in.at("gdim") != embedding.gdim) in.fail("its points have another dimension than the mesh");
  const auto count = static_cast<std::size_t>(sizes.num_points);
  const auto gdim = static_cast<std::size_t>(embedding.gdim);
  embedding.cells = in.table<Index>("cells", count);
  in.check_range("cells", embedding.cells, -1, sizes.num_cells);
  const std::vector<double> local = in.table<double>("local", count * gdim);
  embedding.local = Eigen::Map<const Points>(local.data(), sizes.num_points, embedding.gdim);
  embedding.status = in.table<PointStatus>("status", count);
  for (PointStatus status : embedding.status)
    if (status > PointStatus::not_found) in.fail("\"status\" holds {}", static_cast<int>(status));
  const std::vector<Index> points = in.table<Index>("outside_points");
  std::vector<Index> outside;
  for (Index p = 0; p < sizes.num_points; ++p) {
    const PointStatus status = embedding.status[p];
    if ((status == PointStatus::not_found) != (embedding.cells[p] < 0))
      in.fail("point {} has status {} and cell {}", p, static_cast<int>(status), embedding.cells[p]);
    if (embedding.cells[p] >= 0 && !embedding.local.row(p).allFinite()) in.fail("\"local\" is not finite");
    if (status == PointStatus::outside || status == PointStatus::not_found) outside.push_back(p);
  }
  if (points != outside) in.fail("\"outside_points\" are not those that \"status\" says");
  const std::vector<double> distances = in.weights("outside_distances", points.size());
  const std::vector<double> offsets = in.weights("outside_offsets", points.size() * gdim);
  for (std::size_t i = 0; i < points.size(); ++i)
    embedding.outside.push_back(
        {points[i], distances[i], Eigen::Map<const Eigen::VectorXd>(offsets.data() + i * gdim, embedding.gdim)});
  return embedding;
}

json write_feet(const SurfaceEmbedding& embedding) {
  const WeightedPoints& feet = embedding.feet;
  return {{"offsets", packed(feet.offsets)},  {"vertices", packed(feet.vertices)},
          {"weights", packed(feet.weights)},  {"arms", packed(feet.arms)},
          {"cells", packed(embedding.cells)}, {"distance", packed(embedding.distance)}};
}

SurfaceEmbedding read_feet(const TableReader& in, const BindingSizes& sizes) {
  SurfaceEmbedding embedding;
  WeightedPoints& feet = embedding.feet;
  const auto count = static_cast<std::size_t>(sizes.num_points);
  feet.gdim = sizes.gdim;
  feet.num_vertices = sizes.num_vertices;
  feet.vertices = in.table<Index>("vertices");
  in.check_range("vertices", feet.vertices, 0, sizes.num_vertices);
  feet.offsets = in.offsets("offsets", count, feet.vertices.size());
  feet.weights = in.weights("weights", feet.vertices.size());
  feet.arms = in.weights("arms", static_cast<std::size_t>(sizes.gdim) * feet.vertices.size());
  embedding.cells = in.table<Index>("cells", count);
  in.check_range("cells", embedding.cells, 0, sizes.num_cells);
  embedding.distance = in.weights("distance", count);
  return embedding;
}

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

json write_weights(const SparseMatrix& matrix) {
  const auto entries = static_cast<std::size_t>(matrix.nonZeros());
  const std::vector<Offset> offsets(matrix.outerIndexPtr(), matrix.outerIndexPtr() + matrix.rows() + 1);
  return {{"offsets", packed(offsets)},
          {"vertices", packed(matrix.innerIndexPtr(), entries)},
          {"weights", packed(matrix.valuePtr(), entries)}};
}

SparseMatrix read_weights(const TableReader& in, const BindingSizes& sizes) {
  const std::vector<int> vertices = in.table<int>("vertices");
  in.check_range("vertices", vertices, 0, sizes.num_vertices);
  const std::vector<Offset> ends = in.offsets("offsets", static_cast<std::size_t>(sizes.num_points), vertices.size());
  const std::vector<int> offsets(ends.begin(), ends.end());
  const std::vector<double> weights = in.weights("weights", vertices.size());
  for (std::size_t row = 0; row + 1 < ends.size(); ++row)
    for (Offset e = ends[row] + 1; e < ends[row + 1]; ++e)
      if (vertices[e - 1] >= vertices[e]) in.fail("\"vertices\" of point {} do not ascend", row);
  return Eigen::Map<const SparseMatrix>(sizes.num_points, sizes.num_vertices,
                                        static_cast<Eigen::Index>(vertices.size()), offsets.data(), vertices.data(),
                                        weights.data());
}

json write_table(const GradientStencilTable& table) {
  return {{"vertices", packed(table.vertices)},
          {"offsets", packed(table.offsets)},
          {"neighbors", packed(table.neighbors)},
          {"weights", packed(table.weights)},
          {"hessian_weights", packed(table.hessian_weights)},
          {"rules", [&] {
             std::vector<StencilRule> rules;
             for (const StencilDiagnostics& row : table.diagnostics) rules.push_back(row.rule);
             return packed(rules);
           }()}};
}

GradientStencilTable read_table(const TableReader& in, const BindingSizes& sizes) {
  GradientStencilTable table;
  table.gdim = sizes.gdim;
  const auto gdim = static_cast<std::size_t>(table.gdim);
  table.vertices = in.table<Index>("vertices");
  in.check_range("vertices", table.vertices, 0, sizes.num_vertices);
  table.neighbors = in.table<Index>("neighbors");
  in.check_range("neighbors", table.neighbors, 0, sizes.num_vertices);
  table.offsets = in.offsets("offsets", table.vertices.size(), table.neighbors.size());
  table.weights = in.weights("weights", gdim * table.neighbors.size());
  if (!in.table<double>("hessian_weights").empty())
    table.hessian_weights =
        in.weights("hessian_weights", static_cast<std::size_t>(num_symmetric(table.gdim)) * table.neighbors.size());
  const std::vector<StencilRule> rules = in.table<StencilRule>("rules");
  if (!rules.empty() && rules.size() != table.vertices.size())
    in.fail("\"rules\" has {} entries, expected {}", rules.size(), table.vertices.size());
  for (StencilRule rule : rules) {
    if (rule > StencilRule::none) in.fail("\"rules\" holds {}", static_cast<int>(rule));
    table.diagnostics.emplace_back().rule = rule;
  }
  return table;
}

json write_reconstruction(const Reconstruction& reconstruction) {
  json result = {{"stencils", write_table(reconstruction.stencils)}};
  if (reconstruction.blend) {
    const AdaptiveBlend& blend = *reconstruction.blend;
    result["blend"] = {{"averaging", write_table(blend.averaging)},
                       {"beyond", write_table(blend.beyond)},
                       {"prediction_share", blend.prediction_share},
                       {"caution", packed(blend.caution)},
                       {"edge_offsets", packed(blend.edge_offsets)},
                       {"edge_rows", packed(blend.edge_rows)},
                       {"edges", packed(blend.edges)}};
  }
  return result;
}

Reconstruction read_reconstruction(const TableReader& in, const json& object, const BindingSizes& sizes) {
  Reconstruction result;
  result.stencils = read_table(in.object("stencils"), sizes);
  if (!object.contains("blend")) return result;
  const TableReader from = in.object("blend");
  AdaptiveBlend blend;
  blend.averaging = read_table(from.object("averaging"), sizes);
  if (blend.averaging.vertices != result.stencils.vertices) from.fail("its two tables have other rows");
  blend.beyond = read_table(from.object("beyond"), sizes);
  if (blend.beyond.has_hessians() != result.stencils.has_hessians()) from.fail("its fitted rows differ in kind");
  const std::vector<Index>& rows = result.stencils.vertices;
  const json& share = from.at("prediction_share");
  if (!share.is_number() || !(share >= 0) || !(share <= 1)) from.fail("\"prediction_share\"");
  blend.prediction_share = share;
  blend.caution = from.weights("caution", rows.size());
  blend.edge_rows = from.table<Index>("edge_rows");
  from.check_range("edge_rows", blend.edge_rows, 0, result.stencils.num_rows() + blend.beyond.num_rows());
  blend.edge_offsets = from.offsets("edge_offsets", rows.size(), blend.edge_rows.size());
  blend.edges = from.weights("edges", static_cast<std::size_t>(sizes.gdim) * blend.edge_rows.size());
  result.blend = std::move(blend);
  return result;
}

std::string shown(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

// What bindings consist of: objects of few levels with texts, numbers and byte strings. The library's own builder
// recurses as deep as a file tells it to, and throws on arrays of absurd lengths.
class BindingBuilder final : public json::json_sax_t {
 public:
  json document;

  bool start_object(std::size_t) override {
    constexpr std::size_t most_levels = 8;
    if (open_.size() == most_levels) return false;
    json& object = open_.empty() ? document : (*open_.back())[key_];
    object = json::object();
    open_.push_back(&object);
    return true;
  }
  bool end_object() override { return open_.pop_back(), true; }
  bool key(std::string& name) override { return key_ = std::move(name), true; }
  bool string(std::string& value) override { return put(std::move(value)); }
  bool binary(json::binary_t& value) override { return put(std::move(value)); }
  bool number_integer(std::int64_t value) override { return put(value); }
  bool number_unsigned(std::uint64_t value) override { return put(value); }
  bool number_float(double value, const std::string&) override { return put(value); }
  bool null() override { return false; }
  bool boolean(bool) override { return false; }
  bool start_array(std::size_t) override { return false; }
  bool end_array() override { return false; }
  bool parse_error(std::size_t, const std::string&, const json::exception&) override { return false; }

 private:
  template <class T>
  bool put(T&& value) {
    if (open_.empty()) return false;
    (*open_.back())[key_] = std::forward<T>(value);
    return true;
  }

  std::vector<json*> open_;
  std::string key_;
};

json parse(const std::filesystem::path& path) {
  const InputFile file(path);
  BindingBuilder builder;
  const bool whole =
      json::sax_parse(file.bytes().begin(), file.bytes().end(), &builder, json::input_format_t::cbor, true);
  json document = std::move(builder.document);
  if (!whole || !document.contains("halfgrad_binding"))
    raise("{}: found no binding, expected a file that halfgrad bind wrote", path.string());
  if (document["halfgrad_binding"] != format_version)
    raise("{}: found a binding of version {}, expected {}: bind again", path.string(),
          shown(document["halfgrad_binding"]), format_version);
  return document;
}

}  // namespace

void write_binding(const std::filesystem::path& path, const SavedBinding& binding) {
  json document = {
      {"halfgrad_binding", format_version}, {"settings", binding.settings}, {"fingerprint", binding.fingerprint}};
  if (const auto* embedding = std::get_if<Embedding>(&binding.places))
    document["embedding"] = write_embedding(*embedding);
  else if (const auto* feet = std::get_if<SurfaceEmbedding>(&binding.places))
    document["feet"] = write_feet(*feet);
  else
    document["weights"] = write_weights(std::get<SparseMatrix>(binding.places));
  if (binding.reconstruction) document["reconstruction"] = write_reconstruction(*binding.reconstruction);
  const std::vector<std::uint8_t> bytes = json::to_cbor(document);
  write_text_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

SavedBinding read_binding(const std::filesystem::path& path, const BindingSizes& sizes,
                          const std::string& fingerprint) {
  const json document = parse(path);
  const TableReader in(path.string(), document);
  if (in.at("fingerprint") != fingerprint)
    raise("{}: the binding was made for another rest mesh or other points (fingerprint {}, found {}): bind again",
          path.string(), shown(in.at("fingerprint")), fingerprint);
  SavedBinding binding;
  binding.fingerprint = fingerprint;
  if (!in.at("settings").is_string()) in.fail("\"settings\" is no text");
  binding.settings = in.at("settings");
  if (document.contains("feet"))
    binding.places = read_feet(in.object("feet"), sizes);
  else if (document.contains("weights"))
    binding.places = read_weights(in.object("weights"), sizes);
  else
    binding.places = read_embedding(in.object("embedding"), sizes);
  if (document.contains("reconstruction"))
    binding.reconstruction = read_reconstruction(in.object("reconstruction"), document["reconstruction"], sizes);
  return binding;
}

std::string read_binding_settings(const std::filesystem::path& path) {
  const json document = parse(path);
  const TableReader in(path.string(), document);
  if (!in.at("settings").is_string()) in.fail("\"settings\" is no text");
  return in.at("settings");
}

}  // namespace halfgrad
