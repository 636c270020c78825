// The data arrays of XML VTK files.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "framework/io/input_file.hpp"

namespace pugi {
class xml_document;
class xml_node;
}  // namespace pugi

namespace halfgrad {

/// A parsed XML VTK file. Appended data, which need not be text, is kept apart from the XML.
class VtkXmlFile {
 public:
  /// Throws Error where the XML is malformed or the root is not VTKFile.
  explicit VtkXmlFile(const InputFile& file);
  ~VtkXmlFile();

  pugi::xml_node root() const;
  /// The child of a node that must be there.
  pugi::xml_node child(pugi::xml_node node, const char* name) const;
  /// A count given as an attribute.
  std::int64_t count(pugi::xml_node node, const char* attribute) const;
  /// The DataArray of this name; none where absent.
  pugi::xml_node find_array(pugi::xml_node node, std::string_view name) const;

  /// The values of a DataArray, `expected` of them.
  std::vector<double> numbers(pugi::xml_node array, std::int64_t expected) const;
  std::vector<std::int64_t> integers(pugi::xml_node array, std::int64_t expected) const;

  [[noreturn]] void fail(pugi::xml_node node, const std::string& message) const;

 private:
  template <class T>
  std::vector<T> values(pugi::xml_node array, std::int64_t expected) const;
  std::string binary_bytes(pugi::xml_node array, std::size_t expected) const;
  std::string uncompressed(pugi::xml_node array, std::string_view bytes, std::size_t header_end,
                           std::size_t expected) const;
  std::uint64_t header_word(pugi::xml_node array, std::string_view bytes, std::size_t index) const;

  std::string name_;
  std::string_view text_;
  std::unique_ptr<pugi::xml_document> document_;
  std::string_view appended_;
  bool appended_is_raw_ = false, swap_ = false, compressed_ = false;
  std::size_t header_size_ = 4;
};

}  // namespace halfgrad
