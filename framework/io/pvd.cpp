#include "framework/io/pvd.hpp"

#include <algorithm>
#include <pugixml.hpp>

#include "framework/error.hpp"
#include "framework/io/cursor.hpp"
#include "framework/io/frame_files.hpp"
#include "framework/io/unfinished_run.hpp"
#include "framework/io/vtk_output_text.hpp"

namespace halfgrad {

namespace fs = std::filesystem;

std::unique_ptr<FrameSource> open_pvd_frames(const fs::path& path) {
  const InputFile file(path);
  const std::string_view text = file.bytes();
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_buffer(text.data(), text.size());
  const auto line_of = [&](std::ptrdiff_t offset) {
    return 1 +
           std::count(text.begin(),
                      text.begin() + std::clamp<std::ptrdiff_t>(offset, 0, static_cast<std::ptrdiff_t>(text.size())),
                      '\n');
  };
  if (!result) raise("{}:{}: found malformed XML: {}", path.string(), line_of(result.offset), result.description());
  const pugi::xml_node collection = document.child("VTKFile").child("Collection");
  if (!collection) raise("{}: found no <Collection> in <VTKFile>", path.string());
  std::vector<std::pair<double, fs::path>> steps;
  for (pugi::xml_node step : collection.children("DataSet")) {
    const std::ptrdiff_t line = line_of(step.offset_debug());
    const std::string_view time_text = step.attribute("timestep").as_string(),
                           name = step.attribute("file").as_string();
    double time = static_cast<double>(steps.size());
    if (step.attribute("timestep") && !parse_number(time_text, time))
      raise("{}:{}: found timestep \"{}\", expected a number", path.string(), line, shown(time_text));
    if (name.empty()) raise("{}:{}: <DataSet> has no file", path.string(), line);
    steps.emplace_back(time, path.parent_path() / name);
  }
  if (steps.empty()) raise("{}: found no <DataSet>, expected one a frame", path.string());
  std::stable_sort(steps.begin(), steps.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<fs::path> files;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (i > 0 && steps[i].first == steps[i - 1].first)
      raise("{}: found {} and {} at timestep {}, expected one file a timestep", path.string(),
            steps[i - 1].second.string(), steps[i].second.string(), steps[i].first);
    files.push_back(steps[i].second);
  }
  return open_frame_files(path.string(), std::move(files));
}

namespace {

class PvdSink final : public FrameSink {
 public:
  PvdSink(const fs::path& path, const PointSet& shape, const FrameSinkOptions& options)
      : file_(path), faces_(shape.faces), sequence_(path, options) {}

  void write(const Values<double>& points, std::span<const PointArray> arrays) override { append(points, arrays); }
  void write(const Values<float>& points, std::span<const PointArray> arrays) override { append(points, arrays); }

  Index num_resumable() const override {
    return sequence_.num_resumable([&](std::int64_t number) { return file_name(number); });
  }
  void resume(Index num_frames) override { sequence_.resume(num_frames); }
  // The collection comes last: once it is there, all it names is.
  void finish() override {
    if (sequence_.num_frames() == 0) raise("{}: no frame was written", file_.path().string());
    std::string text =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" "
        "byte_order=\"LittleEndian\">\n<Collection>\n";
    for (Index i = 0; i < sequence_.num_frames(); ++i) {
      const std::int64_t number = sequence_.number(i);
      text += fmt::format("<DataSet timestep=\"{}\" part=\"0\" file=\"{}\"/>\n", number,
                          xml_escaped(file_name(number).filename().string()));
    }
    file_.write(text + "</Collection>\n</VTKFile>\n");
    file_.commit();
    sequence_.finish();
  }

 private:
  template <class Scalar>
  void append(const Values<Scalar>& points, std::span<const PointArray> arrays) {
    const fs::path name = file_name(sequence_.number(sequence_.num_frames()));
    sequence_.append(name, vtp_text(name.string(), points, faces_, arrays));
  }

  fs::path file_name(std::int64_t number) const {
    return file_.path().parent_path() / fmt::format("{}_{:04}.vtp", file_.path().stem().string(), number);
  }

  OutputFile file_;
  IndexTable faces_;
  FileSequence sequence_;
};

}  // namespace

std::unique_ptr<FrameSink> create_pvd_frames(const fs::path& path, const PointSet& shape,
                                             const FrameSinkOptions& options) {
  return std::make_unique<PvdSink>(path, shape, options);
}

}  // namespace halfgrad
