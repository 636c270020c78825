#include "fuzz/memory_file.hpp"

#include <cstring>
#include <string>

#include "framework/error.hpp"
#include "framework/io/input_file.hpp"

namespace halfgrad {

namespace {

std::string first_name;
std::string_view first, second;

}  // namespace

void MemoryFiles::set(std::string_view name, std::string_view input) {
  constexpr std::string_view divider = "\n~~~~\n";
  first_name = name;
  const std::size_t end = input.find(divider);
  first = input.substr(0, end);
  second = end == std::string_view::npos ? std::string_view() : input.substr(end + divider.size());
}

// In the place of framework/io/input_file.cpp.
InputFile::InputFile(const std::filesystem::path& path) : path_(path) {
  const std::string_view bytes = path == first_name ? first : second;
  if (bytes.empty()) raise("{}: the file is empty", path.string());
  char* block = new char[bytes.size()];
  std::memcpy(block, bytes.data(), bytes.size());
  bytes_ = {block, bytes.size()};
}

InputFile::~InputFile() { delete[] bytes_.data(); }

}  // namespace halfgrad
