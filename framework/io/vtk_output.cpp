#include "framework/io/vtk_output.hpp"

#include <bit>

#include "framework/error.hpp"
#include "framework/io/output_file.hpp"
#include "framework/io/vtk_cells.hpp"
#include "framework/io/vtk_output_text.hpp"

namespace halfgrad {

namespace {

template <class T>
constexpr std::string_view vtk_type_name = "";
template <>
constexpr std::string_view vtk_type_name<double> = "Float64";
template <>
constexpr std::string_view vtk_type_name<float> = "Float32";
template <>
constexpr std::string_view vtk_type_name<std::int64_t> = "Int64";
template <>
constexpr std::string_view vtk_type_name<std::uint8_t> = "UInt8";

// XML with all values appended raw, each array behind its size as UInt64.
class XmlText {
 public:
  explicit XmlText(std::string_view type) {
    text_ = fmt::format(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{0}\" version=\"1.0\" byte_order=\"{1}\" "
        "header_type=\"UInt64\">\n<{0}>\n",
        type, std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian");
    end_ = fmt::format("</{}>\n", type);
  }

  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
    text_ += '\n';
  }

  template <class T>
  void add_array(std::string_view name, Eigen::Index num_columns, const T* values, std::size_t count) {
    add("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>",
        vtk_type_name<T>, xml_escaped(name), num_columns, data_.size());
    const std::uint64_t size = count * sizeof(T);
    data_.append(reinterpret_cast<const char*>(&size), sizeof(size));
    data_.append(reinterpret_cast<const char*>(values), size);
  }

  std::string finish() {
    return text_ + end_ + "<AppendedData encoding=\"raw\">\n_" + data_ + "\n</AppendedData>\n</VTKFile>\n";
  }

 private:
  std::string text_, data_, end_;
};

// VTK knows three coordinates only.
template <class Derived>
void add_points(XmlText& xml, const std::string& name, const Eigen::MatrixBase<Derived>& points) {
  if (points.cols() < 1 || points.cols() > 3)
    raise("{}: found {} columns, VTK holds up to 3 coordinates", name, points.cols());
  Values<typename Derived::Scalar> positions(points.rows(), 3);
  positions.setZero();
  positions.leftCols(points.cols()) = points;
  xml.add("<Points>");
  xml.add_array("Points", 3, positions.data(), static_cast<std::size_t>(positions.size()));
  xml.add("</Points>");
}

void add_point_data(XmlText& xml, const std::string& name, Eigen::Index num_points,
                    std::span<const PointArray> arrays) {
  if (arrays.empty()) return;
  xml.add("<PointData>");
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    const PointArray& array = arrays[i];
    if (array.values.rows() != num_points)
      raise("{}: the array \"{}\" has {} rows, expected {}", name, array.name, array.values.rows(), num_points);
    for (std::size_t j = 0; j < i; ++j)
      if (arrays[j].name == array.name) raise("{}: found two arrays of the name \"{}\"", name, array.name);
    xml.add_array(array.name, array.values.cols(), array.values.data(), static_cast<std::size_t>(array.values.size()));
  }
  xml.add("</PointData>");
}

void add_cells(XmlText& xml, const std::vector<std::int64_t>& nodes, const std::vector<std::int64_t>& ends) {
  xml.add_array("connectivity", 1, nodes.data(), nodes.size());
  xml.add_array("offsets", 1, ends.data(), ends.size());
}

template <class Scalar>
std::string vtp(const std::string& name, const Values<Scalar>& points, const IndexTable& faces,
                std::span<const PointArray> arrays) {
  // Without faces every point is a cell of its own, or viewers would show nothing.
  const bool has_faces = faces.num_rows() > 0;
  std::vector<std::int64_t> nodes, ends;
  if (has_faces) {
    nodes.assign(faces.entries.begin(), faces.entries.end());
    ends.assign(faces.offsets.begin() + 1, faces.offsets.end());
  } else {
    for (Eigen::Index v = 0; v < points.rows(); ++v) {
      nodes.push_back(v);
      ends.push_back(v + 1);
    }
  }
  for (std::int64_t node : nodes)
    if (node < 0 || node >= points.rows()) raise("{}: a face names point {} of {}", name, node, points.rows());
  XmlText xml("PolyData");
  xml.add(
      "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"{}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
      "NumberOfPolys=\"{}\">",
      points.rows(), has_faces ? 0 : points.rows(), faces.num_rows());
  add_point_data(xml, name, points.rows(), arrays);
  add_points(xml, name, points);
  xml.add("<{}>", has_faces ? "Polys" : "Verts");
  add_cells(xml, nodes, ends);
  xml.add("</{}>\n</Piece>", has_faces ? "Polys" : "Verts");
  return xml.finish();
}

}  // namespace

std::string xml_escaped(std::string_view text) {
  std::string escaped;
  for (char c : text) {
    if (c == '&')
      escaped += "&amp;";
    else if (c == '<')
      escaped += "&lt;";
    else if (c == '>')
      escaped += "&gt;";
    else if (c == '"')
      escaped += "&quot;";
    else
      escaped += c;
  }
  return escaped;
}

std::string vtp_text(const std::string& name, const Values<double>& points, const IndexTable& faces,
                     std::span<const PointArray> arrays) {
  return vtp(name, points, faces, arrays);
}

std::string vtp_text(const std::string& name, const Values<float>& points, const IndexTable& faces,
                     std::span<const PointArray> arrays) {
  return vtp(name, points, faces, arrays);
}

void write_vtp(const std::filesystem::path& path, const Points& points, const IndexTable& faces,
               std::span<const PointArray> arrays) {
  write_text_atomically(path, vtp_text(path.string(), points, faces, arrays));
}

void write_vtu(const std::filesystem::path& path, const Mesh& mesh, std::span<const PointArray> arrays) {
  std::vector<std::int64_t> nodes, ends;
  std::vector<std::uint8_t> types;
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      for (int i = 0; i < E::num_nodes; ++i) nodes.push_back(block.cells(c, file_node(E::vtk_id, i)));
      ends.push_back((ends.empty() ? 0 : ends.back()) + E::num_nodes);
      types.push_back(E::vtk_id);
    }
  });
  XmlText xml("UnstructuredGrid");
  xml.add("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">", mesh.num_vertices(), mesh.num_cells());
  add_point_data(xml, path.string(), mesh.num_vertices(), arrays);
  add_points(xml, path.string(), mesh.vertices());
  xml.add("<Cells>");
  add_cells(xml, nodes, ends);
  xml.add_array("types", 1, types.data(), types.size());
  xml.add("</Cells>\n</Piece>");
  write_text_atomically(path, xml.finish());
}

}  // namespace halfgrad
