// Points bound to a mesh under the options that all commands share.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "apps/diagnosis.hpp"
#include "experiments/interpolant_spec.hpp"
#include "framework/embedding.hpp"
#include "framework/gradient_stencils.hpp"
#include "framework/grid.hpp"
#include "framework/io/point_set.hpp"
#include "framework/surface.hpp"

namespace halfgrad::app {

/// The options of `deform`, `bind` and `export` that decide a binding.
struct BindOptions {
  std::filesystem::path rest, points;
  std::filesystem::path binding;  ///< a saved binding; it fills in what the others leave open
  std::optional<std::string> interpolant;
  std::optional<double> alpha;
  /// A name or JSON; empty: what the command prefers, on grids centered_difference, for dual_taylor kriging with cubic
  /// drift.
  std::string reconstructor;
  std::optional<std::string> outside;
  std::vector<std::string> limits;  ///< NAME=NUMBER each, besides degenerate_cells=0; see Limits
};

/// Options read and checked, before any large file is opened.
struct BindSettings {
  std::filesystem::path rest, points, binding;
  std::string outside;  ///< empty for baselines: they carry points wherever they lie
  ConfiguredInterpolant interpolant;
  std::string interpolant_specification;             ///< a name, or JSON of a baseline
  std::string reconstructor, reconstructor_options;  ///< name and compact JSON object; of rules that need none too
  std::string specification;                         ///< JSON that make_reconstructor reads
  Limits limits;

  /// A rule that knows vertices only.
  bool is_baseline() const { return interpolant.scattered.has_value(); }
  std::string to_json() const;
};

/// Where the user names no reconstructor: `preferred`, or for rules that need Hessians kriging with cubic drift. Throws
/// Error on unknown names and values, on options that the interpolant does not take, and on those that contradict the
/// saved binding.
BindSettings parse_settings(const BindOptions& options, std::string_view preferred = "adaptive");

/// What binding took and gave.
struct Binding {
  std::optional<Grid> grid;   ///< instead of a mesh
  Mesh mesh;                  ///< a surface in space too
  MeshReport quality;         ///< of a mesh
  std::vector<Fault> faults;  ///< of a mesh
  PointSet surface;
  Points points;  ///< of the surface, in the mesh's dimension
  std::string fingerprint;
  Embedding embedding;
  SurfaceEmbedding feet;                              ///< instead of an embedding, of points near a surface
  std::shared_ptr<const ScatteredTransfer> transfer;  ///< instead of an embedding, of baselines
  std::optional<Reconstruction> reconstruction;
  bool by_vertices = false;  ///< bound by a baseline, which asks for no cells

  bool on_surface() const { return mesh.is_surface() && !by_vertices; }
  int gdim() const { return grid ? grid->gdim() : mesh.gdim(); }
  Index num_vertices() const { return grid ? grid->num_vertices() : mesh.num_vertices(); }
  Index num_cells() const { return grid ? grid->num_cells() : mesh.num_cells(); }
};

/// Reads the rest shape and the points. This and the next two throw Error on faults beyond the limits.
Binding read_inputs(const BindSettings& settings);
/// Locates the points (for a baseline: computes their weights), or takes that from the saved binding.
void locate(const BindSettings& settings, Binding& binding);
/// Reconstructs gradients at the vertices that the points need, unless the saved binding has them. Baselines need none
/// beyond their weights.
void reconstruct(const BindSettings& settings, Binding& binding);

/// What reports say of the interpolant and the reconstructor, null where there is none.
nlohmann::ordered_json rule_facts(const BindSettings& settings);
/// What reports say of a binding: faults of the mesh, the rules that served its vertices, points outside.
nlohmann::ordered_json diagnosis(const BindSettings& settings, const Binding& binding);

/// Runs `halfgrad bind`; `report` is a JSON file, or empty for none.
void save_binding(const BindOptions& options, const std::filesystem::path& out, const std::filesystem::path& report,
                  bool quiet);

}  // namespace halfgrad::app
