#include "framework/io/ply.hpp"

#include <array>

#include "framework/io/cursor.hpp"

namespace halfgrad {

namespace {

enum class Coding { ascii, little_endian, big_endian };

struct Property {
  std::string name, type;
  std::string count_type;  // empty for a scalar
};

struct PlyElement {
  std::string name;
  std::int64_t count;
  std::vector<Property> properties;
};

template <class Function>
bool with_type(std::string_view name, Function&& f) {
  if (name == "float" || name == "float32") return f(float{}), true;
  if (name == "double" || name == "float64") return f(double{}), true;
  if (name == "char" || name == "int8") return f(std::int8_t{}), true;
  if (name == "uchar" || name == "uint8") return f(std::uint8_t{}), true;
  if (name == "short" || name == "int16") return f(std::int16_t{}), true;
  if (name == "ushort" || name == "uint16") return f(std::uint16_t{}), true;
  if (name == "int" || name == "int32") return f(std::int32_t{}), true;
  if (name == "uint" || name == "uint32") return f(std::uint32_t{}), true;
  return false;
}

class PlyReader {
 public:
  explicit PlyReader(const InputFile& file) : in_(file) {}

  Geometry read() {
    read_header();
    for (const PlyElement& element : elements_) {
      const std::int64_t count = in_.count(element.count, element.properties.empty() ? 0 : 1, element.name);
      if (element.name == "vertex") {
        geometry_.vertices.resize(count, 3);
        if (!texture_[0].empty()) geometry_.arrays.push_back({"uv", Values<double>(count, 2)});
      }
      if (element.properties.empty()) continue;
      for (std::int64_t row = 0; row < count; ++row) read_row(element, row);
    }
    return std::move(geometry_);
  }

 private:
  std::string type_name() {
    std::string type(in_.word("a type"));
    if (!with_type(type, [](auto) {}))
      in_.fail_at_line("found type \"{}\", expected one such as float or int32", shown(type));
    return type;
  }

  void read_header() {
    in_.expect("ply");
    in_.expect("format");
    const std::string format(in_.word("the format"));
    if (format == "ascii")
      coding_ = Coding::ascii;
    else if (format == "binary_little_endian")
      coding_ = Coding::little_endian;
    else if (format == "binary_big_endian")
      coding_ = Coding::big_endian;
    else
      in_.fail_at_line("found format \"{}\", expected ascii, binary_little_endian or binary_big_endian", shown(format));
    in_.word("the version");
    for (std::string_view word = in_.word("end_header"); word != "end_header"; word = in_.word("end_header")) {
      if (word == "comment" || word == "obj_info") {
        in_.line();
      } else if (word == "element") {
        const std::string name(in_.word("the name of an element"));
        if (std::any_of(elements_.begin(), elements_.end(), [&](const auto& e) { return e.name == name; }))
          in_.fail_at_line("a second element {}", shown(name));
        elements_.push_back({name, in_.integer("the number of an element"), {}});
      } else if (word == "property" && !elements_.empty()) {
        Property property;
        if (in_.peek() == "list") {
          in_.word("list");
          property.count_type = type_name();
        }
        property.type = type_name();
        property.name = in_.word("the name of a property");
        elements_.back().properties.push_back(property);
      } else {
        in_.fail_at_line("found \"{}\", expected element, property or end_header", shown(word));
      }
    }
    in_.line();
    const auto vertex =
        std::find_if(elements_.begin(), elements_.end(), [](const auto& e) { return e.name == "vertex"; });
    if (vertex == elements_.end()) in_.fail_at_line("found no element vertex");
    const auto has = [&](std::string_view name) {
      return std::any_of(vertex->properties.begin(), vertex->properties.end(),
                         [&](const Property& p) { return p.name == name && p.count_type.empty(); });
    };
    for (std::string_view name : {"x", "y", "z"})
      if (!has(name)) in_.fail_at_line("the element vertex has no property {}", name);
    // Names of texture coordinates as Blender, MeshLab and others write them.
    for (const auto& names : {std::array{"s", "t"}, std::array{"u", "v"}, std::array{"texture_u", "texture_v"}})
      if (texture_[0].empty() && has(names[0]) && has(names[1])) texture_ = {names[0], names[1]};
  }

  double number(const std::string& type, std::string_view what) {
    if (coding_ == Coding::ascii) return in_.number(what);
    const bool swap = (coding_ == Coding::big_endian) != (std::endian::native == std::endian::big);
    double value = 0;
    with_type(type, [&]<class T>(T) { value = static_cast<double>(in_.binary<T>(what, swap)); });
    return value;
  }

  std::int64_t whole(const std::string& type, std::string_view what) {
    const double value = number(type, what);
    if (!(value >= 0 && value <= 4294967295.0) || value != static_cast<double>(static_cast<std::int64_t>(value)))
      in_.fail_at_byte("found {} for {}, expected a whole number from 0", value, what);
    return static_cast<std::int64_t>(value);
  }

  void read_row(const PlyElement& element, std::int64_t row) {
    for (const Property& property : element.properties) {
      if (property.count_type.empty()) {
        const double value = number(property.type, property.name);
        if (element.name == "vertex" && property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z')
          geometry_.vertices(row, property.name[0] - 'x') = value;
        for (int a = 0; a < 2; ++a)
          if (element.name == "vertex" && property.name == texture_[a]) geometry_.arrays.front().values(row, a) = value;
        continue;
      }
      const std::int64_t length = in_.count(whole(property.count_type, "the length of a list"), 1, "entries of a list");
      const bool is_face =
          element.name == "face" && (property.name == "vertex_indices" || property.name == "vertex_index");
      nodes_.clear();
      for (std::int64_t i = 0; i < length; ++i)
        if (is_face)
          nodes_.push_back(whole(property.type, "a vertex of a face"));
        else
          number(property.type, property.name);
      if (is_face) geometry_.add_cell(7, nodes_);
    }
  }

  Cursor in_;
  Coding coding_ = Coding::ascii;
  std::vector<PlyElement> elements_;
  Geometry geometry_;
  std::vector<std::int64_t> nodes_;
  std::array<std::string, 2> texture_;  // names of the vertices' texture coordinates, or empty
};

}  // namespace

Geometry read_ply(const std::filesystem::path& path) {
  const InputFile file(path);
  return PlyReader(file).read();
}

}  // namespace halfgrad
