#include "framework/io/gmsh.hpp"

#include <numeric>

#include "framework/io/cursor.hpp"

namespace halfgrad {

namespace {

// Gmsh's numbers of the linear types; the node order of these is VTK's.
struct GmshType {
  int id;
  int vtk_id;
  int num_nodes;
};
constexpr GmshType gmsh_types[] = {{15, 1, 1}, {1, 3, 2},  {2, 5, 3},  {3, 9, 4},
                                   {4, 10, 4}, {5, 12, 8}, {6, 13, 6}, {7, 14, 5}};

class GmshReader {
 public:
  explicit GmshReader(const InputFile& file) : in_(file) {}

  Geometry read() {
    read_format();
    while (!in_.at_end()) {
      const std::string section(in_.word("a section"));
      if (section.front() != '$') in_.fail_at_line("found \"{}\", expected a section such as $Nodes", shown(section));
      if (section == "$Nodes" || section == "$Elements") {
        if (binary_) in_.line();
        if (section == "$Nodes")
          version_ == 4 ? read_nodes_4() : read_nodes_2();
        else
          version_ == 4 ? read_elements_4() : read_elements_2();
        in_.expect("$End" + section.substr(1));
      } else {
        skip_section("$End" + section.substr(1));
      }
    }
    if (tags_.empty()) in_.fail_at_line("the file ends, expected a section $Nodes");
    return std::move(geometry_);
  }

 private:
  void read_format() {
    in_.expect("$MeshFormat");
    const double version = in_.number("the version");
    if (version != 2.2 && version != 4.1) in_.fail_at_line("found version {}, expected 2.2 or 4.1", version);
    version_ = version == 4.1 ? 4 : 2;
    const std::int64_t kind = in_.integer("the file type");
    if (kind != 0 && kind != 1) in_.fail_at_line("found file type {}, expected 0 (ASCII) or 1 (binary)", kind);
    binary_ = kind == 1;
    if (const std::int64_t size = in_.integer("the data size"); size != 8)
      in_.fail_at_line("found data size {}, expected 8", size);
    if (binary_) {
      in_.line();
      const auto one = in_.binary<std::int32_t>("the number one");
      swap_ = one != 1;
      if (swap_ && byte_swapped(one) != 1) in_.fail_at_byte("found {}, expected the number one", one);
    }
    in_.expect("$EndMeshFormat");
  }

  // Other sections may be binary, so their end can only be searched for.
  void skip_section(const std::string& end) {
    if (!in_.find(end)) in_.fail_at_line("the section is not closed, expected {}", end);
    in_.expect(end);
  }

  // Integers of a block: text, or binary of the type T.
  template <class T>
  std::int64_t integer(std::string_view what) {
    if (!binary_) return in_.integer(what);
    const T value = in_.binary<T>(what, swap_);
    return static_cast<std::int64_t>(value);
  }
  double number(std::string_view what) { return binary_ ? in_.binary<double>(what, swap_) : in_.number(what); }

  template <class... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    if (binary_) in_.fail_at_byte(format, std::forward<Args>(args)...);
    in_.fail_at_line(format, std::forward<Args>(args)...);
  }

  void begin_nodes() {
    if (!tags_.empty()) fail("a second section $Nodes");
  }

  void read_nodes_2() {
    begin_nodes();
    const std::int64_t count = in_.count(in_.integer("the number of nodes"), binary_ ? 28 : 8, "nodes");
    if (binary_) in_.line();
    std::vector<double> positions;
    positions.reserve(static_cast<std::size_t>(3 * count));
    for (std::int64_t i = 0; i < count; ++i) {
      tags_.push_back(integer<std::int32_t>("a node tag"));
      for (int a = 0; a < 3; ++a) positions.push_back(number("a coordinate"));
    }
    set_vertices(positions);
  }

  void read_nodes_4() {
    begin_nodes();
    const std::int64_t num_blocks = integer<std::uint64_t>("the number of node blocks");
    const std::int64_t total = in_.count(integer<std::uint64_t>("the number of nodes"), binary_ ? 32 : 8, "nodes");
    integer<std::uint64_t>("the least node tag");
    integer<std::uint64_t>("the greatest node tag");
    in_.count(num_blocks, 4, "node blocks");
    std::vector<double> positions;
    for (std::int64_t b = 0; b < num_blocks; ++b) {
      const std::int64_t dim = integer<std::int32_t>("an entity's dimension");
      integer<std::int32_t>("an entity's tag");
      const std::int64_t parametric = integer<std::int32_t>("whether nodes are parametric");
      if (dim < 0 || dim > 3) fail("found an entity of dimension {}, expected 0 to 3", dim);
      const std::int64_t count =
          in_.count(integer<std::uint64_t>("the number of nodes of a block"), binary_ ? 32 : 8, "nodes");
      for (std::int64_t i = 0; i < count; ++i) tags_.push_back(integer<std::uint64_t>("a node tag"));
      for (std::int64_t i = 0; i < count; ++i) {
        for (int a = 0; a < 3; ++a) positions.push_back(number("a coordinate"));
        for (std::int64_t a = 0; parametric != 0 && a < dim; ++a) number("a parametric coordinate");
      }
    }
    if (static_cast<std::int64_t>(tags_.size()) != total) fail("found {} nodes, expected {}", tags_.size(), total);
    set_vertices(positions);
  }

  // Orders the vertices by tag.
  void set_vertices(const std::vector<double>& positions) {
    if (tags_.empty()) fail("found no nodes");
    std::vector<std::size_t> order(tags_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (!std::is_sorted(tags_.begin(), tags_.end()))
      std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return tags_[a] < tags_[b]; });
    geometry_.vertices.resize(static_cast<Eigen::Index>(tags_.size()), 3);
    for (std::size_t i = 0; i < order.size(); ++i)
      for (std::size_t a = 0; a < 3; ++a)
        geometry_.vertices(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(a)) = positions[3 * order[i] + a];
    std::sort(tags_.begin(), tags_.end());
    if (const auto twice = std::adjacent_find(tags_.begin(), tags_.end()); twice != tags_.end())
      fail("node tag {} is used twice", *twice);
  }

  std::int64_t vertex_of(std::int64_t tag) {
    if (tags_.empty()) fail("found an element, expected a section $Nodes before");
    // Most files number their nodes from 1 without gaps.
    if (tag >= 1 && static_cast<std::size_t>(tag) <= tags_.size() && tags_[static_cast<std::size_t>(tag - 1)] == tag)
      return tag - 1;
    const auto found = std::lower_bound(tags_.begin(), tags_.end(), tag);
    if (found == tags_.end() || *found != tag)
      fail("an element names node tag {}, which is not among the {} nodes (tags {} to {})", tag, tags_.size(),
           tags_.front(), tags_.back());
    return found - tags_.begin();
  }

  const GmshType& type_of(std::int64_t id, std::int64_t count) {
    for (const GmshType& type : gmsh_types)
      if (type.id == id) return type;
    fail("found {} of Gmsh element type {}, which is of higher order or not known; known are {}", count, id,
         known_types());
  }

  static std::string known_types() {
    std::string names;
    for (const GmshType& type : gmsh_types)
      names += fmt::format("{}{} ({})", names.empty() ? "" : ", ", type.id, find_cell_type(type.vtk_id)->name);
    return names;
  }

  template <class T>
  void read_cell(const GmshType& type) {
    std::int64_t nodes[8];
    for (int i = 0; i < type.num_nodes; ++i) nodes[i] = vertex_of(integer<T>("a node of an element"));
    geometry_.add_cell(type.vtk_id, {nodes, static_cast<std::size_t>(type.num_nodes)});
  }

  void read_elements_2() {
    const std::int64_t total = in_.count(in_.integer("the number of elements"), binary_ ? 8 : 6, "elements");
    if (binary_) in_.line();
    for (std::int64_t i = 0; i < total;) {
      std::int64_t id, count = 1, num_tags;
      if (binary_) {  // a header, then elements of one kind
        id = integer<std::int32_t>("an element type");
        count = integer<std::int32_t>("the number of elements of a block");
        num_tags = integer<std::int32_t>("the number of element tags");
        if (count < 1 || count > total - i) fail("found a block of {} elements, {} are left", count, total - i);
      } else {
        integer<std::int32_t>("an element number");
        id = integer<std::int32_t>("an element type");
        num_tags = integer<std::int32_t>("the number of element tags");
      }
      if (num_tags < 0) fail("found {} element tags, expected a count", num_tags);
      const GmshType& type = type_of(id, count);
      for (std::int64_t c = 0; c < count; ++c) {
        if (binary_) integer<std::int32_t>("an element number");
        for (std::int64_t t = 0; t < num_tags; ++t) integer<std::int32_t>("an element tag");
        read_cell<std::int32_t>(type);
      }
      i += count;
    }
  }

  void read_elements_4() {
    const std::int64_t num_blocks = integer<std::uint64_t>("the number of element blocks");
    const std::int64_t total =
        in_.count(integer<std::uint64_t>("the number of elements"), binary_ ? 16 : 4, "elements");
    integer<std::uint64_t>("the least element tag");
    integer<std::uint64_t>("the greatest element tag");
    in_.count(num_blocks, 4, "element blocks");
    std::int64_t read = 0;
    for (std::int64_t b = 0; b < num_blocks; ++b) {
      integer<std::int32_t>("an entity's dimension");
      integer<std::int32_t>("an entity's tag");
      const std::int64_t id = integer<std::int32_t>("an element type");
      const std::int64_t count =
          in_.count(integer<std::uint64_t>("the number of elements of a block"), binary_ ? 16 : 4, "elements");
      const GmshType& type = type_of(id, count);
      for (std::int64_t c = 0; c < count; ++c) {
        integer<std::uint64_t>("an element tag");
        read_cell<std::uint64_t>(type);
      }
      read += count;
    }
    if (read != total) fail("found {} elements, expected {}", read, total);
  }

  Cursor in_;
  Geometry geometry_;
  std::vector<std::int64_t> tags_;  // ascending once the nodes are read
  int version_ = 0;
  bool binary_ = false, swap_ = false;
};

}  // namespace

Geometry read_gmsh(const std::filesystem::path& path) {
  const InputFile file(path);
  return GmshReader(file).read();
}

}  // namespace halfgrad
