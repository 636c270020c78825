#include "apps/numpy_files.hpp"

#include <zip.h>

#include <ctime>

#include "framework/error.hpp"
#include "framework/io/npy.hpp"
#include "framework/io/output_file.hpp"

namespace halfgrad::app {

namespace {

// A new ZIP file; nothing appears under its name unless close() succeeds.
class ZipFile {
 public:
  explicit ZipFile(const std::filesystem::path& path) : path_(path) {
    int code = 0;
    zip_ = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
    if (zip_ != nullptr) return;
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    const std::string reason = zip_error_strerror(&error);
    zip_error_fini(&error);
    raise("{}: cannot be written: {}", path.string(), reason);
  }
  ~ZipFile() {
    if (zip_ != nullptr) zip_discard(zip_);
  }
  ZipFile(const ZipFile&) = delete;
  ZipFile& operator=(const ZipFile&) = delete;

  // A stored entry of these pieces, which must live until close().
  void add(const std::string& name, std::span<const std::string_view> pieces) {
    std::vector<zip_buffer_fragment_t> fragments;
    for (std::string_view piece : pieces)
      if (!piece.empty())
        fragments.push_back({reinterpret_cast<zip_uint8_t*>(const_cast<char*>(piece.data())), piece.size()});
    zip_source_t* source = zip_source_buffer_fragment(zip_, fragments.data(), fragments.size(), 0);
    const zip_int64_t entry = source == nullptr ? -1 : zip_file_add(zip_, name.c_str(), source, ZIP_FL_OVERWRITE);
    if (entry < 0) {
      if (source != nullptr) zip_source_free(source);
      fail();
    }
    const auto number = static_cast<zip_uint64_t>(entry);
    // Numbers hardly shrink, and stored arrays can be mapped. One date for all: DOS's first, as NumPy has it.
    std::tm date{};
    date.tm_year = 80;
    date.tm_mday = 1;
    date.tm_isdst = -1;
    if (zip_set_file_compression(zip_, number, ZIP_CM_STORE, 0) != 0 ||
        zip_file_set_mtime(zip_, number, std::mktime(&date), 0) != 0)
      fail();
  }

  void close() {
    if (zip_close(zip_) != 0) fail();
    zip_ = nullptr;
  }

 private:
  [[noreturn]] void fail() { raise("{}: cannot be written: {}", path_.string(), zip_strerror(zip_)); }

  std::filesystem::path path_;
  zip_t* zip_ = nullptr;
};

}  // namespace

void write_npy_array(const std::filesystem::path& path, const NumpyArray& array) {
  OutputFile file(path);
  file.write(npy_header(array.type, array.shape));
  file.write(array.bytes);
  file.commit();
}

void write_npz(const std::filesystem::path& path, std::span<const NumpyArray> arrays) {
  std::vector<std::string> headers;
  for (const NumpyArray& array : arrays) headers.push_back(npy_header(array.type, array.shape));
  ZipFile file(path);
  for (std::size_t a = 0; a < arrays.size(); ++a)
    file.add(arrays[a].name + ".npy", std::array<std::string_view, 2>{headers[a], arrays[a].bytes});
  file.close();
}

}  // namespace halfgrad::app
