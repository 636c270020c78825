#include "framework/io/vtk_legacy.hpp"

#include "framework/io/cursor.hpp"
#include "framework/io/vtk_cells.hpp"

namespace halfgrad {

namespace {

// Calls f with a value of the C++ type that a type name of the format stands for; false for an unknown name.
template <class Function>
bool with_type(std::string_view name, Function&& f) {
  if (name == "double" || name == "float64") return f(double{}), true;
  if (name == "float" || name == "float32") return f(float{}), true;
  if (name == "vtktypeint64" || name == "vtkIdType" || name == "long" || name == "int64")
    return f(std::int64_t{}), true;
  if (name == "vtktypeuint64" || name == "unsigned_long") return f(std::uint64_t{}), true;
  if (name == "int" || name == "vtktypeint32") return f(std::int32_t{}), true;
  if (name == "unsigned_int" || name == "vtktypeuint32") return f(std::uint32_t{}), true;
  if (name == "short") return f(std::int16_t{}), true;
  if (name == "unsigned_short") return f(std::uint16_t{}), true;
  if (name == "char" || name == "signed_char") return f(std::int8_t{}), true;
  if (name == "unsigned_char") return f(std::uint8_t{}), true;
  return false;
}

class LegacyReader {
 public:
  explicit LegacyReader(const InputFile& file) : in_(file) {}

  Geometry read() {
    read_header();
    while (!in_.at_end()) read_section(std::string(in_.word("a section")));
    if (geometry_.vertices.rows() == 0) in_.fail_at_line("the file ends, expected POINTS");
    add_cells();
    return std::move(geometry_);
  }

 private:
  void read_header() {
    const std::string_view first = in_.line();
    constexpr std::string_view intro = "# vtk DataFile Version ";
    double version = 0;
    if (!first.starts_with(intro) || !parse_number(first.substr(intro.size(), 3), version))
      in_.fail_at_line("found \"{}\", expected \"{}5.1\" or the like", shown(first), intro);
    if (version < 1 || version >= 6) in_.fail_at_line("found version {}, expected 2.0 to 5.1", version);
    has_offsets_ = version >= 5;
    in_.line();  // the title
    const std::string_view kind = in_.word("ASCII or BINARY");
    if (kind != "ASCII" && kind != "BINARY") in_.fail_at_line("found \"{}\", expected ASCII or BINARY", shown(kind));
    binary_ = kind == "BINARY";
  }

  void read_section(const std::string& section) {
    if (section == "DATASET") {
      const std::string_view type = in_.word("the type of the data set");
      if (type != "UNSTRUCTURED_GRID" && type != "POLYDATA")
        in_.fail_at_line("found a data set {}, expected UNSTRUCTURED_GRID or POLYDATA", shown(type));
    } else if (section == "POINTS") {
      read_points();
    } else if (section == "CELLS") {
      cells_ = read_cells();
    } else if (section == "CELL_TYPES") {
      const std::int64_t count = in_.integer("the number of cell types");
      types_ = values<std::int64_t>("int", count, "cell types");
    } else if (section == "VERTICES" || section == "LINES" || section == "POLYGONS" || section == "TRIANGLE_STRIPS") {
      const int id = section == "VERTICES" ? 2 : section == "LINES" ? 4 : section == "POLYGONS" ? 7 : 6;
      const VtkCells cells = read_cells();
      cells.add_to(geometry_, id);
    } else if (section == "POINT_DATA" || section == "CELL_DATA") {
      num_tuples_ = in_.integer("the number of values");
      at_points_ = section == "POINT_DATA";
    } else if (section == "METADATA") {
      in_.line();
      while (in_.remaining() > 0 && !in_.line().empty()) {
      }
    } else {
      read_attribute(section);
    }
  }

  void read_attribute(const std::string& section) {
    const auto read_array = [&](std::int64_t num_components) {
      const std::string name(in_.word("the name of an array")), type(in_.word("the type of an array"));
      add_array(name, type, num_components, num_tuples_);
    };
    if (section == "FIELD") {
      in_.word("the name of the field");
      const std::int64_t num_arrays = in_.count(in_.integer("the number of arrays"), 4, "arrays");
      for (std::int64_t i = 0; i < num_arrays; ++i) {
        if (in_.peek() == "METADATA") read_section(std::string(in_.word("METADATA")));
        const std::string name(in_.word("the name of an array"));
        const std::int64_t num_components = in_.integer("the number of components");
        const std::int64_t num_tuples = in_.integer("the number of values");
        add_array(name, std::string(in_.word("the type of an array")), num_components, num_tuples);
      }
    } else if (section == "VECTORS" || section == "NORMALS") {
      read_array(3);
    } else if (section == "TENSORS") {
      read_array(9);
    } else if (section == "TENSORS6") {
      read_array(6);
    } else if (section == "GLOBAL_IDS" || section == "PEDIGREE_IDS") {
      read_array(1);
    } else if (section == "SCALARS") {
      const std::string name(in_.word("the name of an array")), type(in_.word("the type of an array"));
      const std::int64_t num_components = in_.at_line_end() ? 1 : in_.integer("the number of components");
      if (in_.peek() == "LOOKUP_TABLE") {
        in_.word("LOOKUP_TABLE");
        in_.word("the name of the table");
      }
      add_array(name, type, num_components, num_tuples_);
    } else if (section == "LOOKUP_TABLE") {
      in_.word("the name of the table");
      skip_values(binary_ ? "unsigned_char" : "float", 4, in_.integer("the size of the table"));
    } else if (section == "COLOR_SCALARS") {
      in_.word("the name of an array");
      skip_values(binary_ ? "unsigned_char" : "float", in_.integer("the number of components"), num_tuples_);
    } else if (section == "TEXTURE_COORDINATES") {
      const std::string name(in_.word("the name of an array"));
      const std::int64_t num_components = in_.integer("the number of components");
      add_array(name, std::string(in_.word("the type of an array")), num_components, num_tuples_);
    } else {
      in_.fail_at_line("found \"{}\", expected a section such as POINTS or POINT_DATA", shown(section));
    }
  }

  // The values after a keyword's line.
  template <class T>
  std::vector<T> values(const std::string& type, std::int64_t count, std::string_view what) {
    std::vector<T> found;
    const bool known = with_type(type, [&]<class Stored>(Stored) {
      count = in_.count(count, binary_ ? sizeof(Stored) : 2, what);
      found.reserve(static_cast<std::size_t>(count));
      if (binary_) {
        in_.line();
        constexpr bool swap = std::endian::native == std::endian::little;
        for (std::int64_t i = 0; i < count; ++i) found.push_back(converted<T>(in_.binary<Stored>(what, swap)));
      } else {
        for (std::int64_t i = 0; i < count; ++i)
          if constexpr (std::is_integral_v<T>)
            found.push_back(static_cast<T>(in_.integer(what)));
          else
            found.push_back(in_.number(what));
      }
    });
    if (!known)
      in_.fail_at_line("found the type \"{}\", expected a number type such as float or vtktypeint64", shown(type));
    return found;
  }

  std::int64_t product(std::int64_t num_components, std::int64_t num_tuples) {
    if (num_components < 0 || num_tuples < 0 || num_components > 1000)
      in_.fail_at_line("found {} components of {} values, expected counts", num_components, num_tuples);
    return num_components * in_.count(num_tuples, 0, "values");
  }

  void skip_values(const std::string& type, std::int64_t num_components, std::int64_t num_tuples) {
    values<double>(type, product(num_components, num_tuples), "values");
  }

  void add_array(const std::string& name, const std::string& type, std::int64_t num_components,
                 std::int64_t num_tuples) {
    const std::vector<double> found = values<double>(type, product(num_components, num_tuples), name);
    if (at_points_ && num_components > 0 && num_tuples == geometry_.vertices.rows())
      geometry_.arrays.push_back({name, Eigen::Map<const Points>(found.data(), num_tuples, num_components)});
  }

  void read_points() {
    const std::int64_t count = in_.count(in_.integer("the number of points"), binary_ ? 12 : 6, "points");
    const std::vector<double> found =
        values<double>(std::string(in_.word("the type of the points")), 3 * count, "a coordinate");
    geometry_.vertices = Eigen::Map<const Points>(found.data(), count, 3);
  }

  VtkCells read_cells() {
    VtkCells cells{in_.name(), {}, {}};
    const std::int64_t first = in_.integer("a count of cells"), second = in_.integer("a count of nodes");
    if (has_offsets_) {
      in_.expect("OFFSETS");
      cells.offsets = values<std::int64_t>(std::string(in_.word("the type of the offsets")), first, "offsets");
      in_.expect("CONNECTIVITY");
      cells.nodes = values<std::int64_t>(std::string(in_.word("the type of the nodes")), second, "nodes");
      return cells;
    }
    const std::vector<std::int64_t> list = values<std::int64_t>("int", second, "nodes");
    cells.offsets.push_back(0);
    for (std::size_t at = 0; at < list.size(); at += static_cast<std::size_t>(list[at]) + 1) {
      if (list[at] < 0 || static_cast<std::size_t>(list[at]) >= list.size() - at)
        in_.fail_at_line("cell {} has {} nodes, {} numbers are left", cells.offsets.size() - 1, list[at],
                         list.size() - at - 1);
      const auto begin = list.begin() + static_cast<std::ptrdiff_t>(at) + 1;
      cells.nodes.insert(cells.nodes.end(), begin, begin + list[at]);
      cells.offsets.push_back(static_cast<std::int64_t>(cells.nodes.size()));
    }
    if (static_cast<std::int64_t>(cells.offsets.size()) != first + 1)
      in_.fail_at_line("found {} cells, expected {}", cells.offsets.size() - 1, first);
    return cells;
  }

  void add_cells() {
    if (cells_.offsets.empty() && types_.empty()) return;
    cells_.add_to(geometry_, types_);
  }

  Cursor in_;
  Geometry geometry_;
  bool binary_ = false, has_offsets_ = false, at_points_ = false;
  std::int64_t num_tuples_ = 0;
  VtkCells cells_;
  std::vector<std::int64_t> types_;
};

}  // namespace

Geometry read_vtk_legacy(const std::filesystem::path& path) {
  const InputFile file(path);
  return LegacyReader(file).read();
}

}  // namespace halfgrad
