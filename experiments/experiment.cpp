#include "experiments/experiment.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "experiments/experiment_config.hpp"
#include "experiments/hold_out.hpp"
#include "experiments/html_report.hpp"
#include "experiments/interactive_report.hpp"
#include "experiments/recommendation.hpp"
#include "experiments/report.hpp"
#include "experiments/scene.hpp"
#include "experiments/sequence_writer.hpp"
#include "framework/error.hpp"
#include "framework/io/frame_source.hpp"
#include "reconstruction/cell_averages.hpp"

namespace halfgrad {
namespace {

/// Runs `work` as often as asked and returns the median of its seconds; the last result stays.
template <class Work>
double median_seconds(int repetitions, Work&& work) {
  std::vector<double> seconds(repetitions);
  for (double& second : seconds) {
    const auto start = std::chrono::steady_clock::now();
    work();
    second = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  std::nth_element(seconds.begin(), seconds.begin() + repetitions / 2, seconds.end());
  return seconds[repetitions / 2];
}

/// The deformed vertices and true points of a level, one frame at a time.
class FrameSequence {
 public:
  FrameSequence(const ExperimentConfig& config, const Mesh& mesh, const Points& points, int level,
                const HeldOutMesh* held_out)
      : config_(config), mesh_(mesh), points_(points), held_out_(held_out) {
    if (!config.files) {
      numbers_.resize(config.fields.size());
      std::iota(numbers_.begin(), numbers_.end(), 0);
      return;
    }
    frames_ = open_frames(config.files->frames[level].string());
    const Offset num_vertices = mesh.num_vertices() + (held_out == nullptr ? 0 : points.rows());
    if (frames_->num_vertices() != num_vertices)
      raise("{}: frames of {} vertices, but the mesh has {}", config.files->frames[level].string(),
            frames_->num_vertices(), num_vertices);
    if (held_out == nullptr) open_truth(level);
    select_frames();
  }

  const std::vector<int>& numbers() const { return numbers_; }

  void read(int frame, Points& values, Points& truth) {
    if (!config_.files) {
      values = field_values(*config_.fields[frame], mesh_.vertices());
      truth = field_values(*config_.fields[frame], points_);
    } else if (held_out_ != nullptr) {
      Points all;
      frames_->read(frame, all);
      values = all(held_out_->kept, Eigen::all);
      truth = all(held_out_->held_out, Eigen::all);
    } else {
      frames_->read(frame, values);
      truth_->read(frame, truth);
    }
  }

 private:
  void open_truth(int level) {
    truth_ = open_frames(config_.files->truth.string());
    if (truth_->num_vertices() != points_.rows())
      raise("{}: {} true points, but there are {} points", config_.files->truth.string(), truth_->num_vertices(),
            points_.rows());
    if (truth_->num_frames() != frames_->num_frames() || truth_->num_columns() != frames_->num_columns())
      raise("{}: {} frames of {} coordinates, but {} has {} of {}", config_.files->truth.string(), truth_->num_frames(),
            truth_->num_columns(), config_.files->frames[level].string(), frames_->num_frames(),
            frames_->num_columns());
  }

  void select_frames() {
    const int count = static_cast<int>(frames_->num_frames());
    if (config_.files->select.empty()) {
      numbers_.resize(count);
      std::iota(numbers_.begin(), numbers_.end(), 0);
    }
    for (const int number : config_.files->select) {
      numbers_.push_back(number < 0 ? count + number : number);
      if (numbers_.back() < 0 || numbers_.back() >= count) raise("/field/select: frame {} of {} frames", number, count);
    }
  }

  const ExperimentConfig& config_;
  const Mesh& mesh_;
  const Points& points_;
  const HeldOutMesh* held_out_;
  std::unique_ptr<FrameSource> frames_, truth_;
  std::vector<int> numbers_;
};

/// An interpolant bound with a reconstructor, and what bind tells of it.
struct BoundRule {
  std::optional<Interpolant<double>> interpolant;  ///< none for rules that know vertices only
  std::optional<ScatteredTransfer> scattered = std::nullopt;
  bool is_exact = false;
  ResultRow facts;  ///< what is the same for all frames
};

/// James 2020, Fig. 6: σ = √(Σ (w'_k − 1)² / n) over the cells of all vertices. Weights sum to one at each vertex, so
/// that σ is a little below 1 for harmless weights, and large where they are fitted to noise.
std::optional<double> weight_deviation(const VertexGradientReconstructor& reconstructor, const CellGradients& cells,
                                       const std::vector<Index>& vertices) {
  const auto* average = dynamic_cast<const CellAverage*>(&reconstructor);
  if (average == nullptr) return std::nullopt;
  double sum = 0;
  std::size_t count = 0;
  for (const Index vertex : vertices) {
    const CellWeights weights = average->weights(cells, vertex);
    for (const double weight : weights.weights) sum += (weight - 1) * (weight - 1);
    count += weights.weights.size();
  }
  if (count == 0) return std::nullopt;
  return std::sqrt(sum / static_cast<double>(count));
}

double greatest_absolute_sum(const Eigen::SparseMatrix<double, Eigen::RowMajor>& matrix) {
  double greatest = 0;
  for (Eigen::Index row = 0; row < matrix.outerSize(); ++row) {
    double sum = 0;
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(matrix, row); entry; ++entry)
      sum += std::abs(entry.value());
    greatest = std::max(greatest, sum);
  }
  return greatest;
}

/// Exact gradients and Hessians of a field at an interpolant's active vertices, in the layout of evaluate_given.
void exact_derivatives(const Field& field, const Mesh& mesh, std::span<const Index> active, Points& gradients,
                       Points& hessians) {
  const int gdim = mesh.gdim(), symmetric = num_symmetric(gdim);
  gradients.resize(static_cast<Eigen::Index>(active.size()), gdim * gdim);
  hessians.resize(static_cast<Eigen::Index>(active.size()), gdim * symmetric);
  for (std::size_t row = 0; row < active.size(); ++row) {
    const FieldJet jet = field.jet(mesh.vertices().row(active[row]).transpose());
    for (int c = 0; c < gdim; ++c) {
      for (int a = 0; a < gdim; ++a) gradients(row, c * gdim + a) = jet.gradient(c, a);
      for (int a = 0, s = 0; a < gdim; ++a)
        for (int b = a; b < gdim; ++b, ++s) hessians(row, c * symmetric + s) = jet.hessian[c](a, b);
    }
  }
}

std::string element_names(const Mesh& mesh) {
  std::string names;
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>&, Index) {
    if (!names.empty()) names += '+';
    names += E::name;
  });
  return names;
}

void add_gains(std::span<ResultRow> frame) {
  const auto linear =
      std::find_if(frame.begin(), frame.end(), [](const ResultRow& row) { return row.interpolant == "linear"; });
  if (linear == frame.end()) return;
  const std::array<RegionError, 3> reference = linear->error;
  const double linear_seconds = linear->evaluate_seconds;
  for (ResultRow& row : frame) {
    if (linear_seconds > 0) row.time_over_linear = (row.gradients_seconds + row.evaluate_seconds) / linear_seconds;
    for (int region = 0; region < 3; ++region) {
      const RegionError& error = row.error[region];
      if (reference[region].rms > 0 && error.rms > 0) row.gain_over_linear[region] = reference[region].rms / error.rms;
      if (reference[region].max > 0 && error.max > 0)
        row.max_gain_over_linear[region] = reference[region].max / error.max;
    }
  }
}

/// What a level gives besides its rows, where asked for.
struct LevelOutputs {
  LevelPicture* picture = nullptr;
  std::string* scene = nullptr;                ///< JSON for the interactive report
  std::filesystem::path sequence_folder = {};  ///< for every rule's deformed points
  std::vector<std::string> files = {};         ///< written into it
};

/// One level of one configuration, or one fold of vertices held out.
class LevelRun {
 public:
  LevelRun(const ExperimentConfig& config, int level, std::function<void(std::string_view, double)> progress)
      : config_(config),
        level_(level),
        progress_(std::move(progress)),
        grid_(config.mesh.make_grid ? std::optional(config.mesh.make_grid(level)) : std::nullopt),
        mesh_(grid_ ? grid_->mesh() : config.mesh.make(level)),
        cloud_(config.points(mesh_, config.mesh.is_zoom ? 0 : level)) {}

  LevelRun(const ExperimentConfig& config, const Mesh& whole, HeldOutMesh held_out,
           std::function<void(std::string_view, double)> progress)
      : config_(config),
        level_(0),
        progress_(std::move(progress)),
        held_out_(std::move(held_out)),
        mesh_(held_out_->mesh),
        cloud_{whole.vertices()(held_out_->held_out, Eigen::all), {}} {}

  std::vector<ResultRow> run(LevelOutputs& outputs) {
    LevelPicture* const picture = outputs.picture;
    bind(picture);
    FrameSequence frames(config_, mesh_, cloud_.positions, level_, held_out_ ? &*held_out_ : nullptr);
    std::vector<ResultRow> rows;
    Points values, truth;
    const std::vector<int>& numbers = frames.numbers();
    std::optional<SceneRecorder> recorder;
    std::optional<SequenceWriter> writer;
    if (!outputs.sequence_folder.empty()) {
      std::vector<ResultRow> facts;
      for (const BoundRule& rule : rules_) facts.push_back(rule.facts);
      writer.emplace(outputs.sequence_folder, mesh_, cloud_, facts);
    }
    if (outputs.scene != nullptr) recorder.emplace(mesh_, cloud_, numbers.size(), rules_.size());
    std::vector<Points> results(rules_.size());
    for (std::size_t f = 0; f < numbers.size(); ++f) {
      progress_(fmt::format("level {}: frame {}", level_, numbers[f]), 0.5 + 0.5 * double(f) / double(numbers.size()));
      frames.read(numbers[f], values, truth);
      const std::size_t first = rows.size();
      for (std::size_t r = 0; r < rules_.size(); ++r) {
        rows.push_back(measure(rules_[r], numbers[f], values, truth, results[r]));
        if (picture != nullptr && f + 1 == numbers.size())
          picture->errors.emplace_back(rows.back(), (results[r] - truth).rowwise().norm());
      }
      if (recorder && recorder->wants(f)) recorder->add(numbers[f], values, truth, results);
      if (writer) writer->add(values, truth, results);
      add_gains(std::span(rows).subspan(first));
    }
    if (recorder) *outputs.scene = recorder->text();
    if (writer) outputs.files = writer->finish();
    if (picture != nullptr) {
      picture->mesh = mesh_;
      picture->cloud = cloud_;
    }
    return rows;
  }

 private:
  void bind(LevelPicture* picture) {
    progress_(fmt::format("level {}: locate {} points", level_, cloud_.positions.rows()), 0);
    Embedding embedding;
    ResultRow facts;
    facts.level = level_;
    facts.element = element_names(mesh_);
    facts.vertices = mesh_.num_vertices();
    facts.cells = mesh_.num_cells();
    facts.h = mean_edge_length(mesh_);
    facts.points = static_cast<Index>(cloud_.positions.rows());
    facts.locate_seconds = median_seconds(config_.repetitions, [&] {
      const EmbedOptions options{.outside = config_.outside};
      embedding = grid_ ? embed(*grid_, cloud_.positions, options) : embed(mesh_, cloud_.positions, options);
    });
    facts.outside_points = static_cast<Index>(embedding.outside.size());
    place_points(embedding);
    const std::vector<Index> active = grid_ ? active_vertices(*grid_, embedding) : active_vertices(mesh_, embedding);

    for (const ConfiguredInterpolant& named : config_.interpolants)
      if (!named.needs_gradients()) add_rule(embedding, named, facts, nullptr, nullptr);
    for (std::size_t r = 0; r < config_.reconstructors.size(); ++r) {
      const MadeReconstructor& made = config_.reconstructors[r];
      progress_(fmt::format("level {}: {}", level_, made.name),
                0.1 + 0.4 * double(r) / double(config_.reconstructors.size()));
      ResultRow own = facts;
      own.reconstructor = made.name;
      own.options = made.options;
      Reconstruction reconstruction;
      if (made.reconstructor) {
        own.reconstruct_seconds = median_seconds(config_.repetitions, [&] {
          reconstruction = grid_ ? made.reconstructor->reconstruct_on_grid(*grid_, active)
                                 : made.reconstructor->reconstruct(CellGradients(mesh_), active);
        });
        own.sigma = weight_deviation(*made.reconstructor, CellGradients(mesh_), active);
        if (picture != nullptr) picture->stencils.emplace_back(made.name, reconstruction.stencils);
      }
      for (const ConfiguredInterpolant& named : config_.interpolants) {
        if (!named.needs_gradients()) continue;
        // Pairs that cannot be are left out, so that one list of each serves a whole table.
        if (named.needs_hessians() && made.reconstructor && !reconstruction.stencils.has_hessians()) continue;
        if (named.scattered && (!made.reconstructor || reconstruction.blend)) continue;
        add_rule(embedding, named, own, &made, &reconstruction);
      }
    }
    if (rules_.empty()) raise("/interpolants: none of them can be combined with any of the reconstructors");
  }

  void add_rule(const Embedding& embedding, const ConfiguredInterpolant& named, ResultRow facts,
                const MadeReconstructor* made, const Reconstruction* reconstruction) {
    if (named.scattered) {
      add_scattered(named, std::move(facts), made);
      return;
    }
    const bool is_exact = made != nullptr && !made->reconstructor;
    const Reconstruction* given = is_exact ? nullptr : reconstruction;
    BoundRule rule;
    if (grid_)
      rule.interpolant.emplace(*grid_, embedding, named.rule, given);
    else
      rule.interpolant.emplace(mesh_, embedding, named.rule, given);
    rule.is_exact = is_exact;
    rule.facts = std::move(facts);
    rule.facts.interpolant = named.name;
    if (named.rule.formula == Formula::blend) rule.facts.alpha = named.rule.alpha;
    const BindReport& report = rule.interpolant->report();
    rule.facts.skipped_cells = report.num_cells - report.num_active_cells;
    rule.facts.skipped_vertices = report.num_vertices - report.num_active_vertices;
    if (!is_exact && (reconstruction == nullptr || !reconstruction->blend))
      rule.facts.max_abs_sum = greatest_absolute_sum(rule.interpolant->matrix());
    rules_.push_back(std::move(rule));
  }

  // No cells are searched, and gradients are part of the weights: all of bind is "reconstruct".
  void add_scattered(const ConfiguredInterpolant& named, ResultRow facts, const MadeReconstructor* made) {
    BoundRule rule;
    rule.facts = std::move(facts);
    rule.facts.interpolant = named.name;
    nlohmann::json own = nlohmann::json::parse(named.options);
    if (made != nullptr) own.update(nlohmann::json::parse(made->options));
    rule.facts.options = own.dump();
    rule.facts.locate_seconds = 0;
    rule.facts.reconstruct_seconds = median_seconds(config_.repetitions, [&] {
      rule.scattered.emplace(mesh_, cloud_.positions, *named.scattered,
                             made == nullptr ? nullptr : made->reconstructor.get());
    });
    rule.facts.max_abs_sum = greatest_absolute_sum(rule.scattered->matrix());
    rules_.push_back(std::move(rule));
  }

  void place_points(const Embedding& embedding) {
    const std::vector<char> boundary = boundary_vertices(mesh_);
    places_.resize(embedding.cells.size());
    for (std::size_t p = 0; p < places_.size(); ++p) {
      if (embedding.cells[p] < 0) {
        places_[p] = PointPlace::nowhere;
        continue;
      }
      const auto vertices = mesh_.cell_vertices(embedding.cells[p]);
      const bool touches = std::any_of(vertices.begin(), vertices.end(), [&](Index v) { return boundary[v] != 0; });
      places_[p] = touches ? PointPlace::boundary : PointPlace::interior;
    }
  }

  ResultRow measure(const BoundRule& rule, int frame, const Points& values, const Points& truth, Points& result) const {
    ResultRow row = rule.facts;
    row.frame = frame;
    if (rule.scattered) {
      row.evaluate_seconds = median_seconds(config_.repetitions, [&] { result = rule.scattered->evaluate(values); });
      row.error = region_errors(result, truth, places_);
      return row;
    }
    const Interpolant<double>& interpolant = *rule.interpolant;
    Points gradients, hessians;
    if (rule.is_exact) {
      exact_derivatives(*config_.fields[frame], mesh_, interpolant.active(), gradients, hessians);
    } else if (interpolant.rule().needs_gradients()) {
      row.gradients_seconds =
          median_seconds(config_.repetitions, [&] { interpolant.vertex_derivatives(values, gradients, hessians); });
    }
    const EvaluateOptions options{.tolerance = config_.tolerance};
    row.evaluate_seconds = median_seconds(
        config_.repetitions, [&] { interpolant.evaluate_given(values, gradients, hessians, result, options); });
    if (config_.tolerance > 0 && !rule.is_exact && interpolant.rule().needs_gradients())
      row.linear_cells = interpolant.num_linear_cells(values, options);
    row.error = region_errors(result, truth, places_);
    return row;
  }

  const ExperimentConfig& config_;
  int level_;
  std::function<void(std::string_view, double)> progress_;
  std::optional<HeldOutMesh> held_out_;
  std::optional<Grid> grid_;  // binds where there is one; its explicit mesh only places points and measures
  Mesh mesh_;
  PointCloud cloud_;
  std::vector<PointPlace> places_;
  std::vector<BoundRule> rules_;
};

bool wants(const ExperimentConfig& config, OutputKind kind) {
  return std::find(config.outputs.begin(), config.outputs.end(), kind) != config.outputs.end();
}

/// report.html, and scene.json where there is a level to show, so that `halfgrad report` can show the run beside
/// others.
void write_html(const std::filesystem::path& directory, ExperimentResult& result) {
  std::string page;
  if (report_script().empty()) {
    page = results_html(result.name, {&result, 1});
  } else {
    const ReportedRun run{results_json(result), result.scene};
    page = interactive_html(result.name, {&run, 1});
    if (!result.scene.empty()) write_report(directory / "scene.json", result.scene, result.files);
  }
  write_report(directory / "report.html", page, result.files);
}

/// The rows of all folds, pooled.
std::vector<ResultRow> run_folds(const ExperimentConfig& config, const RunOptions& options) {
  const Mesh mesh = config.mesh.make(0);
  std::vector<ResultRow> rows;
  for (int fold = 0; fold < config.num_folds; ++fold) {
    const auto progress = [&](std::string_view stage, double fraction) {
      if (options.progress) options.progress(stage, (fold + fraction) / config.num_folds);
    };
    HeldOutMesh held_out = hold_out(mesh, config.seed + static_cast<std::uint64_t>(fold));
    LevelOutputs none;
    const std::vector<ResultRow> more = LevelRun(config, mesh, std::move(held_out), progress).run(none);
    if (fold == 0)
      rows = more;
    else
      pool_fold(rows, more);
  }
  // Rows of a frame stand together.
  for (std::size_t begin = 0, end = 0; begin < rows.size(); begin = end) {
    while (end < rows.size() && rows[end].frame == rows[begin].frame) ++end;
    add_gains(std::span(rows).subspan(begin, end - begin));
  }
  return rows;
}

}  // namespace

ExperimentResult run_experiment(const std::filesystem::path& path, const RunOptions& options) {
  const ExperimentConfig config =
      read_experiment_config(path, options.overrides, options.reduced, options.reconstructors);
  ExperimentResult result;
  result.name = config.name;
  result.config = config.resolved;
  if (options.check_only) return result;

  LevelPicture picture;
  if (config.num_folds > 0) {
    result.rows = run_folds(config, options);
    result.recommendation = recommend(result.rows);
  }
  const int num_levels = config.num_folds > 0 ? 0 : config.mesh.num_levels;
  for (int level = 0; level < num_levels; ++level) {
    const auto progress = [&](std::string_view stage, double fraction) {
      if (options.progress) options.progress(stage, (level + fraction) / num_levels);
    };
    LevelOutputs outputs;
    if (level == num_levels - 1) {
      if (wants(config, OutputKind::vtu)) outputs.picture = &picture;
      if (wants(config, OutputKind::html) && !report_script().empty()) outputs.scene = &result.scene;
      if (wants(config, OutputKind::sequence) && !options.out_directory.empty())
        outputs.sequence_folder = options.out_directory / "sequence";
    }
    LevelRun run(config, level, progress);
    const std::vector<ResultRow> rows = run.run(outputs);
    result.files.insert(result.files.end(), outputs.files.begin(), outputs.files.end());
    result.rows.insert(result.rows.end(), rows.begin(), rows.end());
  }
  result.machine = machine_facts();
  result.orders = orders_of(result.rows);
  result.expectations = check_expectations(config.expectations, result.rows, result.orders);
  if (!options.out_directory.empty()) {
    std::filesystem::create_directories(options.out_directory);
    if (wants(config, OutputKind::vtu) && num_levels > 0) write_pictures(options.out_directory, picture, result.files);
    if (wants(config, OutputKind::csv))
      write_report(options.out_directory / "results.csv", results_csv(result), result.files);
    if (wants(config, OutputKind::html)) write_html(options.out_directory, result);
    if (wants(config, OutputKind::json))
      write_report(options.out_directory / "results.json", results_json(result), result.files);
  }
  return result;
}

}  // namespace halfgrad
