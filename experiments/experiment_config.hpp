// A configuration, read and validated: everything that a run needs.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "experiments/expectations.hpp"
#include "experiments/fields.hpp"
#include "experiments/interpolant_spec.hpp"
#include "experiments/mesh_source.hpp"
#include "experiments/point_source.hpp"
#include "framework/embedding.hpp"
#include "framework/interpolant.hpp"
#include "reconstruction/registry.hpp"

namespace halfgrad {

/// Deformed vertices and true points from files.
struct FrameFiles {
  std::vector<std::filesystem::path> frames;  ///< one a level
  std::filesystem::path truth;                ///< empty where vertices are held out
  std::vector<int> select;                    ///< frame numbers, negative ones from the end; empty is all
};

enum class OutputKind : std::uint8_t { json, csv, html, vtu, sequence };

struct ExperimentConfig {
  std::string name;
  std::uint64_t seed = 0;
  MeshSource mesh;
  PointSource points;                          ///< none where vertices are held out
  int num_folds = 0;                           ///< how often vertices are held out as points; 0 is not at all
  std::vector<std::unique_ptr<Field>> fields;  ///< one a frame; none where files give the frames
  std::optional<FrameFiles> files;             ///< none where a field does
  std::vector<ConfiguredInterpolant> interpolants;
  std::vector<MadeReconstructor> reconstructors;  ///< `exact` has a null reconstructor
  Outside outside = Outside::error;
  double tolerance = 0;  ///< of evaluation, length units
  int repetitions = 1;
  std::vector<Expectation> expectations;
  std::vector<OutputKind> outputs;
  std::string resolved;  ///< JSON with every default filled in
};

/// Reads a configuration file. `overrides` are "/json/pointer=VALUE"; `reduced` applies the object of that name first.
/// `reconstructors` are known besides the registry's. Throws Error that names the file and the JSON pointer.
ExperimentConfig read_experiment_config(const std::filesystem::path& path, const std::vector<std::string>& overrides,
                                        bool reduced, std::span<const ReconstructorEntry> reconstructors = {});

}  // namespace halfgrad
