#include "framework/io/vtk_xml_data.hpp"

#include <zlib.h>

#include <algorithm>
#include <pugixml.hpp>

#include "framework/io/base64.hpp"
#include "framework/io/cursor.hpp"
#include "framework/io/vtk_cells.hpp"

namespace halfgrad {

namespace {

// Calls f with a value of the C++ type that a VTK type name stands for; false for an unknown name.
template <class Function>
bool with_type(std::string_view name, Function&& f) {
  if (name == "Float64") return f(double{}), true;
  if (name == "Float32") return f(float{}), true;
  if (name == "Int64") return f(std::int64_t{}), true;
  if (name == "UInt64") return f(std::uint64_t{}), true;
  if (name == "Int32") return f(std::int32_t{}), true;
  if (name == "UInt32") return f(std::uint32_t{}), true;
  if (name == "Int16") return f(std::int16_t{}), true;
  if (name == "UInt16") return f(std::uint16_t{}), true;
  if (name == "Int8") return f(std::int8_t{}), true;
  if (name == "UInt8") return f(std::uint8_t{}), true;
  return false;
}

constexpr std::size_t greatest_zlib_ratio = 1032;

}  // namespace

VtkXmlFile::VtkXmlFile(const InputFile& file)
    : name_(file.path().string()), text_(file.bytes()), document_(std::make_unique<pugi::xml_document>()) {
  // Raw appended data would break the XML parser: the text ends where it begins.
  std::string xml(text_);
  const std::size_t tag = text_.find("<AppendedData");
  if (tag != std::string_view::npos) {
    const std::size_t begin = text_.find('_', text_.find('>', tag));
    if (begin == std::string_view::npos) raise("{}: the appended data does not begin with _", name_);
    appended_ = text_.substr(begin + 1);
    appended_is_raw_ = text_.substr(tag, begin - tag).find("base64") == std::string_view::npos;
    xml = std::string(text_.substr(0, tag)) + "</VTKFile>";
  }
  const pugi::xml_parse_result result = document_->load_buffer(xml.data(), xml.size());
  if (!result) {
    const auto at = text_.begin() + std::min<std::ptrdiff_t>(result.offset, static_cast<std::ptrdiff_t>(text_.size()));
    raise("{}:{}: found malformed XML: {}", name_, 1 + std::count(text_.begin(), at, '\n'), result.description());
  }
  const pugi::xml_node file_root = document_->child("VTKFile");
  if (!file_root) raise("{}: found <{}>, expected <VTKFile>", name_, shown(document_->first_child().name()));
  const std::string_view order = file_root.attribute("byte_order").as_string("LittleEndian");
  if (order != "LittleEndian" && order != "BigEndian")
    fail(file_root, fmt::format("found byte_order \"{}\", expected LittleEndian or BigEndian", shown(order)));
  swap_ = (order == "BigEndian") != (std::endian::native == std::endian::big);
  const std::string_view compressor = file_root.attribute("compressor").as_string();
  if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
    fail(file_root, fmt::format("found compressor \"{}\", expected vtkZLibDataCompressor or none", shown(compressor)));
  compressed_ = !compressor.empty();
  const std::string_view header_type = file_root.attribute("header_type").as_string("UInt32");
  if (header_type != "UInt32" && header_type != "UInt64")
    fail(file_root, fmt::format("found header_type \"{}\", expected UInt32 or UInt64", shown(header_type)));
  header_size_ = header_type == "UInt64" ? 8 : 4;
}

VtkXmlFile::~VtkXmlFile() = default;

pugi::xml_node VtkXmlFile::root() const { return document_->child("VTKFile"); }

void VtkXmlFile::fail(pugi::xml_node node, const std::string& message) const {
  const auto offset = std::clamp<std::ptrdiff_t>(node.offset_debug(), 0, static_cast<std::ptrdiff_t>(text_.size()));
  raise("{}:{}: <{}>: {}", name_, 1 + std::count(text_.begin(), text_.begin() + offset, '\n'), shown(node.name()),
        message);
}

pugi::xml_node VtkXmlFile::child(pugi::xml_node node, const char* name) const {
  const pugi::xml_node found = node.child(name);
  if (!found) fail(node, fmt::format("has no <{}>", name));
  return found;
}

std::int64_t VtkXmlFile::count(pugi::xml_node node, const char* attribute) const {
  const std::string_view text = node.attribute(attribute).as_string();
  std::int64_t value = 0;
  if (!parse_integer(text, value) || value < 0)
    fail(node, fmt::format("found {}=\"{}\", expected a count", attribute, shown(text)));
  return value;
}

pugi::xml_node VtkXmlFile::find_array(pugi::xml_node node, std::string_view name) const {
  for (pugi::xml_node array : node.children("DataArray"))
    if (array.attribute("Name").as_string() == name) return array;
  return {};
}

std::vector<double> VtkXmlFile::numbers(pugi::xml_node array, std::int64_t expected) const {
  return values<double>(array, expected);
}

std::vector<std::int64_t> VtkXmlFile::integers(pugi::xml_node array, std::int64_t expected) const {
  return values<std::int64_t>(array, expected);
}

template <class T>
std::vector<T> VtkXmlFile::values(pugi::xml_node array, std::int64_t expected) const {
  const auto count = static_cast<std::size_t>(expected);
  const std::string_view type = array.attribute("type").as_string();
  std::vector<T> found;
  const bool known = with_type(type, [&]<class Stored>(Stored) {
    const std::string_view format = array.attribute("format").as_string("ascii");
    if (format == "ascii") {
      Cursor in(name_, array.child_value());
      if (count > in.remaining())
        fail(array, fmt::format("holds {} bytes of text, expected {} values", in.remaining(), count));
      found.reserve(count);
      while (!in.at_end() && found.size() < count) {
        const std::string_view word = in.word("a value");
        T value{};
        bool valid = false;
        if constexpr (std::is_integral_v<T>)
          valid = parse_integer(word, value);
        else
          valid = parse_number(word, value);
        if (!valid) fail(array, fmt::format("found \"{}\" as value {}, expected a number", shown(word), found.size()));
        found.push_back(value);
      }
      if (found.size() != count || !in.at_end())
        fail(array,
             fmt::format("holds {} values, expected {}", in.at_end() ? std::to_string(found.size()) : "more", count));
      return;
    }
    if (format != "binary" && format != "appended")
      fail(array, fmt::format("found format \"{}\", expected ascii, binary or appended", shown(format)));
    if (count > text_.size() * greatest_zlib_ratio / sizeof(Stored))
      fail(array, fmt::format("expected {} values, the file has {} bytes", count, text_.size()));
    const std::string bytes = binary_bytes(array, count * sizeof(Stored));
    found.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      Stored value;
      std::memcpy(&value, bytes.data() + i * sizeof(Stored), sizeof(Stored));
      found[i] = converted<T>(swap_ ? byte_swapped(value) : value);
    }
  });
  if (!known) fail(array, fmt::format("found type \"{}\", expected a number type such as Float64", shown(type)));
  return found;
}

std::uint64_t VtkXmlFile::header_word(pugi::xml_node array, std::string_view bytes, std::size_t index) const {
  if (bytes.size() / header_size_ <= index) fail(array, "the data ends within its header");
  const char* at = bytes.data() + index * header_size_;
  const auto load = [&]<class T>(T value) {
    std::memcpy(&value, at, sizeof(T));
    return static_cast<std::uint64_t>(swap_ ? byte_swapped(value) : value);
  };
  return header_size_ == 8 ? load(std::uint64_t{}) : load(std::uint32_t{});
}

// The bytes of the values. The header before them is one word, their size; or, compressed, the number of blocks, the
// size of a block and of the last one, and the compressed size of each.
std::string VtkXmlFile::binary_bytes(pugi::xml_node array, std::size_t expected) const {
  std::string decoded;
  std::string_view bytes;
  if (std::string_view(array.attribute("format").as_string()) == "appended") {
    const std::int64_t offset = count(array, "offset");
    if (static_cast<std::uint64_t>(offset) > appended_.size())
      fail(array, fmt::format("found offset {}, the appended data has {} bytes", offset, appended_.size()));
    bytes = appended_.substr(static_cast<std::size_t>(offset));
    if (!appended_is_raw_) {
      // The encoded stream ends nowhere visible: enough of it for the size that may be needed is decoded.
      decoded = decode_base64(bytes, expected + expected / 16 + 4096);
      bytes = decoded;
    }
  } else {
    decoded = decode_base64(array.child_value(), std::string_view::npos);
    bytes = decoded;
  }
  if (compressed_) {
    const std::uint64_t num_blocks = header_word(array, bytes, 0);
    if (num_blocks > bytes.size() / header_size_)
      fail(array, fmt::format("found {} compressed blocks in {} bytes", num_blocks, bytes.size()));
    return uncompressed(array, bytes, (3 + static_cast<std::size_t>(num_blocks)) * header_size_, expected);
  }
  const std::uint64_t size = header_word(array, bytes, 0);
  if (size != expected) fail(array, fmt::format("holds {} bytes, expected {}", size, expected));
  if (bytes.size() - header_size_ < expected)
    fail(array, fmt::format("the data ends after {} bytes, expected {}", bytes.size() - header_size_, expected));
  return std::string(bytes.substr(header_size_, expected));
}

std::string VtkXmlFile::uncompressed(pugi::xml_node array, std::string_view bytes, std::size_t header_end,
                                     std::size_t expected) const {
  const std::uint64_t num_blocks = header_word(array, bytes, 0);
  const std::uint64_t block_size = header_word(array, bytes, 1), last_size = header_word(array, bytes, 2);
  if (expected / greatest_zlib_ratio > bytes.size())
    fail(array, fmt::format("holds {} compressed bytes, too few for {}", bytes.size(), expected));
  std::string result;
  result.reserve(expected);
  std::size_t at = header_end;
  for (std::uint64_t b = 0; b < num_blocks; ++b) {
    const std::uint64_t size = b + 1 == num_blocks && last_size != 0 ? last_size : block_size;
    const std::uint64_t packed = header_word(array, bytes, 3 + static_cast<std::size_t>(b));
    if (at > bytes.size() || packed > bytes.size() - at)
      fail(array, fmt::format("the data ends within compressed block {}", b));
    if (size > expected - result.size())
      fail(array, fmt::format("block {} of {} bytes exceeds the {} expected", b, size, expected));
    const std::size_t begin = result.size();
    result.resize(begin + static_cast<std::size_t>(size));
    auto written = static_cast<uLongf>(size);
    const int status = ::uncompress(reinterpret_cast<Bytef*>(result.data() + begin), &written,
                                    reinterpret_cast<const Bytef*>(bytes.data() + at), static_cast<uLong>(packed));
    if (status != Z_OK || written != size) fail(array, fmt::format("compressed block {} is damaged", b));
    at += static_cast<std::size_t>(packed);
  }
  if (result.size() != expected) fail(array, fmt::format("holds {} bytes, expected {}", result.size(), expected));
  return result;
}

}  // namespace halfgrad
