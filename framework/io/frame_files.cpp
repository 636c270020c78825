#include "framework/io/frame_files.hpp"

#include <algorithm>
#include <cctype>

#include "framework/error.hpp"
#include "framework/io/cursor.hpp"
#include "framework/io/formats.hpp"
#include "framework/io/frame_pattern.hpp"

namespace halfgrad {

namespace {

namespace fs = std::filesystem;

// The point vector `displacement`, or null.
const PointArray* displacement_of(const PointSet& set) {
  const PointArray* array = find_array(set.arrays, "displacement");
  return array != nullptr && array->values.cols() == 3 ? array : nullptr;
}

class FileFrames final : public FrameSource {
 public:
  FileFrames(const std::string& name, std::vector<fs::path> files, PointSet first, bool displaced)
      : FrameSource(name, static_cast<Index>(files.size()), static_cast<Index>(first.points.rows()),
                    static_cast<int>(first.points.cols())),
        files_(std::move(files)),
        first_(std::move(first.points)),
        arrays_(std::move(first.arrays)),
        displaced_(displaced) {}

  std::string frame_name(Index frame) const override { return files_[static_cast<std::size_t>(frame)].string(); }
  std::span<const PointArray> arrays() const override { return arrays_; }

 private:
  void fill(Index frame, Values<double>& out) override {
    const fs::path& file = files_[static_cast<std::size_t>(frame)];
    PointSet set = read_points(file);
    if (set.points.rows() != first_.rows() || set.points.cols() != first_.cols())
      raise("{}: frame {} has {} vertices with {} coordinates, expected {} with {} as in {}", file.string(), frame,
            set.points.rows(), set.points.cols(), first_.rows(), first_.cols(), files_.front().string());
    out = std::move(set.points);
    if (const PointArray* moved = displacement_of(set); displaced_ && moved != nullptr && out == first_)
      out += moved->values.leftCols(out.cols());
    arrays_ = std::move(set.arrays);
  }
  std::vector<fs::path> files_;
  Points first_;
  std::vector<PointArray> arrays_;
  bool displaced_;
};

// Compares digit runs by their value: x2 before x10.
bool natural_less(const std::string& a, const std::string& b) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      while (i < a.size() && a[i] == '0') ++i;
      while (j < b.size() && b[j] == '0') ++j;
      std::size_t m = i, n = j;
      while (m < a.size() && is_digit(a[m])) ++m;
      while (n < b.size() && is_digit(b[n])) ++n;
      if (m - i != n - j) return m - i < n - j;
      if (const int order = a.compare(i, m - i, b, j, n - j); order != 0) return order < 0;
      i = m;
      j = n;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;
}

// Whether a name matches a pattern of * and ?.
bool matches(std::string_view name, std::string_view pattern) {
  std::size_t n = 0, p = 0, star = std::string_view::npos, restart = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      restart = n;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
      ++n;
      ++p;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++restart;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

std::vector<std::string> names_in(const fs::path& folder, const std::string& spec) {
  std::error_code reason;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, reason))
    names.push_back(entry.path().filename().string());
  if (reason) raise("{}: the folder cannot be read: {}", spec, reason.message());
  return names;
}

std::vector<fs::path> numbered_files(const std::string& spec, const FramePattern& pattern) {
  const fs::path folder = fs::path(spec).parent_path();
  std::vector<std::int64_t> numbers;
  for (const std::string& name : names_in(folder, spec))
    if (const auto number = pattern.number(name)) numbers.push_back(*number);
  if (numbers.empty()) raise("{}: found no file of this pattern, expected one a frame", spec);
  std::sort(numbers.begin(), numbers.end());
  std::vector<fs::path> files;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0 && numbers[i] != numbers[i - 1] + 1)
      raise("{}: frame file {} is missing between {} and {}", spec,
            (folder / pattern.name(numbers[i - 1] + 1)).string(), pattern.name(numbers[i - 1]),
            pattern.name(numbers[i]));
    files.push_back(folder / pattern.name(numbers[i]));
  }
  return files;
}

std::vector<fs::path> globbed_files(const std::string& spec) {
  const fs::path path(spec);
  std::vector<std::string> names;
  for (const std::string& name : names_in(path.parent_path(), spec))
    if (name.front() != '.' && matches(name, path.filename().string())) names.push_back(name);
  if (names.empty()) raise("{}: found no file of this pattern, expected one a frame", spec);
  std::sort(names.begin(), names.end(), natural_less);
  std::vector<fs::path> files;
  for (const std::string& name : names) files.push_back(path.parent_path() / name);
  return files;
}

}  // namespace

std::unique_ptr<FrameSource> open_frame_files(const std::string& name, std::vector<fs::path> files) {
  PointSet first = read_points(files.front());
  const bool displaced =
      displacement_of(first) != nullptr && (files.size() == 1 || read_points(files.back()).points == first.points);
  return std::make_unique<FileFrames>(name, std::move(files), std::move(first), displaced);
}

std::unique_ptr<FrameSource> open_frames(const std::string& spec) {
  const fs::path path(spec);
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    const std::string folder = path.parent_path().string(), name = path.filename().string();
    if (folder.find_first_of("*?%#") != std::string::npos && !fs::exists(folder, ignored))
      raise("{}: expected the pattern in the file name, found it in the folder", spec);
    if (name.find_first_of("*?") != std::string::npos) return open_frame_files(spec, globbed_files(spec));
    if (const auto pattern = FramePattern::parse(name)) return open_frame_files(spec, numbered_files(spec, *pattern));
  }
  const Format& format = find_format(path, FormatUse::open_frames);
  return format.open_frames != nullptr ? format.open_frames(path) : open_frame_files(spec, {path});
}

}  // namespace halfgrad
