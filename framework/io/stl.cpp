#include "framework/io/stl.hpp"

#include "framework/io/cursor.hpp"

namespace halfgrad {

namespace {

constexpr std::size_t header_size = 80, facet_size = 50;
constexpr bool swap_bytes = std::endian::native == std::endian::big;

// Binary files may begin with "solid" too; only their size tells.
bool is_binary(std::string_view bytes) {
  if (bytes.size() < header_size + 4) return false;
  std::uint32_t count;
  std::memcpy(&count, bytes.data() + header_size, 4);
  if (swap_bytes) count = byte_swapped(count);
  return bytes.size() == header_size + 4 + facet_size * std::size_t{count} || !bytes.starts_with("solid");
}

std::vector<double> read_binary(Cursor& in) {
  in.skip(header_size, "the header");
  const auto count = in.binary<std::uint32_t>("the number of facets", swap_bytes);
  if (in.remaining() / facet_size < count)
    in.fail_at_byte("found {} facets, the {} bytes that follow hold {}", count, in.remaining(),
                    in.remaining() / facet_size);
  std::vector<double> positions;
  positions.reserve(9 * std::size_t{count});
  for (std::uint32_t f = 0; f < count; ++f) {
    in.skip(12, "a normal");
    for (int i = 0; i < 9; ++i) positions.push_back(static_cast<double>(in.binary<float>("a coordinate", swap_bytes)));
    in.skip(2, "the attributes of a facet");
  }
  return positions;
}

std::vector<double> read_ascii(Cursor& in) {
  std::vector<double> positions;
  in.expect("solid");
  in.line();  // the name
  while (in.peek() == "facet") {
    in.expect("facet");
    in.expect("normal");
    for (int i = 0; i < 3; ++i) in.word("a normal");
    in.expect("outer");
    in.expect("loop");
    for (int i = 0; i < 3; ++i) {
      in.expect("vertex");
      for (int a = 0; a < 3; ++a) positions.push_back(in.number("a coordinate"));
    }
    in.expect("endloop");
    in.expect("endfacet");
  }
  in.expect("endsolid");
  return positions;
}

}  // namespace

Geometry read_stl(const std::filesystem::path& path) {
  const InputFile file(path);
  Cursor in(file);
  const std::vector<double> positions = is_binary(file.bytes()) ? read_binary(in) : read_ascii(in);
  Geometry geometry;
  geometry.vertices = Eigen::Map<const Points>(positions.data(), static_cast<Eigen::Index>(positions.size() / 3), 3);
  for (std::int64_t v = 0; v + 2 < geometry.vertices.rows(); v += 3) {
    const std::int64_t nodes[] = {v, v + 1, v + 2};
    geometry.add_cell(5, nodes);
  }
  return geometry;
}

}  // namespace halfgrad
