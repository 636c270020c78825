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

constexpr int format_version = 2;

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

Embedding read_embedding(const TableReader& in, const Mesh& mesh, Index num_points) {
  Embedding embedding;
  embedding.gdim = mesh.gdim();
  if (in.at("gdim") != embedding.gdim) in.fail("its points have another dimension than the mesh");
  const auto count = static_cast<std::size_t>(num_points);
  const auto gdim = static_cast<std::size_t>(embedding.gdim);
  embedding.cells = in.table<Index>("cells", count);
  in.check_range("cells", embedding.cells, -1, mesh.num_cells());
  const std::vector<double> local = in.table<double>("local", count * gdim);
  embedding.local = Eigen::Map<const Points>(local.data(), num_points, embedding.gdim);
  embedding.status = in.table<PointStatus>("status", count);
  for (PointStatus status : embedding.status)
    if (status > PointStatus::not_found) in.fail("\"status\" holds {}", static_cast<int>(status));
  const std::vector<Index> points = in.table<Index>("outside_points");
  in.check_range("outside_points", points, 0, num_points);
  const std::vector<double> distances = in.table<double>("outside_distances", points.size());
  const std::vector<double> offsets = in.table<double>("outside_offsets", points.size() * gdim);
  for (std::size_t i = 0; i < points.size(); ++i)
    embedding.outside.push_back(
        {points[i], distances[i], Eigen::Map<const Eigen::VectorXd>(offsets.data() + i * gdim, embedding.gdim)});
  return embedding;
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

GradientStencilTable read_table(const TableReader& in, const Mesh& mesh) {
  GradientStencilTable table;
  table.gdim = mesh.gdim();
  const auto gdim = static_cast<std::size_t>(table.gdim);
  table.vertices = in.table<Index>("vertices");
  in.check_range("vertices", table.vertices, 0, mesh.num_vertices());
  table.neighbors = in.table<Index>("neighbors");
  in.check_range("neighbors", table.neighbors, 0, mesh.num_vertices());
  table.offsets = in.offsets("offsets", table.vertices.size(), table.neighbors.size());
  table.weights = in.weights("weights", gdim * table.neighbors.size());
  if (!in.table<double>("hessian_weights").empty())
    table.hessian_weights =
        in.weights("hessian_weights", static_cast<std::size_t>(num_symmetric(table.gdim)) * table.neighbors.size());
  for (StencilRule rule : in.table<StencilRule>("rules")) {
    if (rule > StencilRule::none) in.fail("\"rules\" holds {}", static_cast<int>(rule));
    table.diagnostics.emplace_back().rule = rule;
  }
  return table;
}

json write_reconstruction(const Reconstruction& reconstruction) {
  json result = {{"stencils", write_table(reconstruction.stencils)}};
  if (reconstruction.blend) {
    const AdaptiveBlend& blend = *reconstruction.blend;
    result["blend"] = {{"averaging", write_table(blend.averaging)},  {"probing", write_table(blend.probing)},
                       {"prediction_share", blend.prediction_share}, {"edge_offsets", packed(blend.edge_offsets)},
                       {"edge_rows", packed(blend.edge_rows)},       {"edges", packed(blend.edges)}};
  }
  return result;
}

Reconstruction read_reconstruction(const TableReader& in, const json& object, const Mesh& mesh) {
  Reconstruction result;
  result.stencils = read_table(in.object("stencils"), mesh);
  if (!object.contains("blend")) return result;
  const TableReader from = in.object("blend");
  AdaptiveBlend blend;
  blend.averaging = read_table(from.object("averaging"), mesh);
  if (blend.averaging.vertices != result.stencils.vertices) from.fail("its two tables have other rows");
  blend.probing = read_table(from.object("probing"), mesh);
  const std::vector<Index>& rows = result.stencils.vertices;
  if (blend.probing.vertices.size() < rows.size() ||
      !std::equal(rows.begin(), rows.end(), blend.probing.vertices.begin()))
    from.fail("the edges are tested with other rows");
  const json& share = from.at("prediction_share");
  if (!share.is_number() || !(share >= 0) || !(share <= 1)) from.fail("\"prediction_share\"");
  blend.prediction_share = share;
  blend.edge_rows = from.table<Index>("edge_rows");
  from.check_range("edge_rows", blend.edge_rows, 0, blend.probing.num_rows());
  blend.edge_offsets = from.offsets("edge_offsets", rows.size(), blend.edge_rows.size());
  blend.edges = from.weights("edges", static_cast<std::size_t>(mesh.gdim()) * blend.edge_rows.size());
  result.blend = std::move(blend);
  return result;
}

json parse(const std::filesystem::path& path) {
  const InputFile file(path);
  const std::string_view bytes = file.bytes();
  json document = json::from_cbor(bytes.begin(), bytes.end(), true, false);
  if (document.is_discarded() || !document.is_object() || !document.contains("halfgrad_binding"))
    raise("{}: found no binding, expected a file that halfgrad bind wrote", path.string());
  if (document["halfgrad_binding"] != format_version)
    raise("{}: found a binding of version {}, expected {}: bind again", path.string(),
          document["halfgrad_binding"].dump(), format_version);
  return document;
}

}  // namespace

void write_binding(const std::filesystem::path& path, const SavedBinding& binding) {
  json document = {{"halfgrad_binding", format_version},
                   {"settings", binding.settings},
                   {"fingerprint", binding.fingerprint},
                   {"embedding", write_embedding(binding.embedding)}};
  if (binding.reconstruction) document["reconstruction"] = write_reconstruction(*binding.reconstruction);
  const std::vector<std::uint8_t> bytes = json::to_cbor(document);
  write_text_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

SavedBinding read_binding(const std::filesystem::path& path, const Mesh& mesh, Index num_points,
                          const std::string& fingerprint) {
  const json document = parse(path);
  const TableReader in(path.string(), document);
  if (in.at("fingerprint") != fingerprint)
    raise("{}: the binding was made for another rest mesh or other points (fingerprint {}, found {}): bind again",
          path.string(), in.at("fingerprint").dump(), fingerprint);
  SavedBinding binding;
  binding.fingerprint = fingerprint;
  if (!in.at("settings").is_string()) in.fail("\"settings\" is no text");
  binding.settings = in.at("settings");
  binding.embedding = read_embedding(in.object("embedding"), mesh, num_points);
  if (document.contains("reconstruction"))
    binding.reconstruction = read_reconstruction(in.object("reconstruction"), document["reconstruction"], mesh);
  return binding;
}

std::string read_binding_settings(const std::filesystem::path& path) {
  const json document = parse(path);
  const TableReader in(path.string(), document);
  if (!in.at("settings").is_string()) in.fail("\"settings\" is no text");
  return in.at("settings");
}

}  // namespace halfgrad
