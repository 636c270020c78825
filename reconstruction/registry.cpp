#include "reconstruction/registry.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "framework/error.hpp"
#include "framework/json_values.hpp"
#include "reconstruction/adaptive.hpp"
#include "reconstruction/cell_averages.hpp"
#include "reconstruction/centered_difference.hpp"
#include "reconstruction/kriging.hpp"
#include "reconstruction/patch_recovery.hpp"

namespace halfgrad {

std::span<const ReconstructorEntry> reconstructor_registry() {
  static const std::array entries = {
      ReconstructorEntry{"unweighted_average", "mean of the adjacent cells' gradients",
                         [](JsonReader&) -> std::unique_ptr<VertexGradientReconstructor> {
                           return std::make_unique<UnweightedAverage>();
                         }},
      ReconstructorEntry{"volume_average", "mean of the adjacent cells' gradients, weighted by volume",
                         [](JsonReader&) -> std::unique_ptr<VertexGradientReconstructor> {
                           return std::make_unique<VolumeAverage>();
                         }},
      ReconstructorEntry{"inverse_distance",
                         "mean of the adjacent cells' gradients, weighted by 1 / distance to centroid",
                         [](JsonReader&) -> std::unique_ptr<VertexGradientReconstructor> {
                           return std::make_unique<InverseDistance>();
                         }},
      ReconstructorEntry{"chandrashekar_garg", "James 2020, Eq. 24-27: inverse-distance weights, Tikhonov epsilon",
                         [](JsonReader& options) -> std::unique_ptr<VertexGradientReconstructor> {
                           return std::make_unique<ChandrashekarGarg>(
                               ChandrashekarGargOptions{.epsilon = options.number("epsilon", 1)});
                         }},
      ReconstructorEntry{"knn", "the same weights over the adjacent cells and the k cells whose centroids are nearest",
                         [](JsonReader& options) -> std::unique_ptr<VertexGradientReconstructor> {
                           KnnOptions knn;
                           knn.k = small_integer(options, "k", knn.k);
                           knn.epsilon = options.number("epsilon", knn.epsilon);
                           return std::make_unique<Knn>(knn);
                         }},
      ReconstructorEntry{"spr", "linear fit of the cells' gradients at their centroids (Zienkiewicz and Zhu 1992)",
                         [](JsonReader& options) -> std::unique_ptr<VertexGradientReconstructor> {
                           SprOptions spr;
                           spr.rings = small_integer(options, "rings", spr.rings);
                           return std::make_unique<Spr>(spr);
                         }},
      ReconstructorEntry{"ppr", "gradient of a quadratic fitted to the values around a vertex (Zhang and Naga 2005)",
                         [](JsonReader& options) -> std::unique_ptr<VertexGradientReconstructor> {
                           PprOptions ppr;
                           ppr.rings = small_integer(options, "rings", ppr.rings);
                           return std::make_unique<Ppr>(ppr);
                         }},
      ReconstructorEntry{"kriging", "vertex stencil, exact for quadratics (or cubics), Matern prior for the rest",
                         [](JsonReader& options) -> std::unique_ptr<VertexGradientReconstructor> {
                           KrigingOptions kriging;
                           if (options.choice("drift", {"quadratic", "cubic"}, "quadratic") == "cubic")
                             kriging.drift = KrigingDrift::cubic;
                           if (options.choice("patch", {"wide", "lean"}, "wide") == "lean")
                             kriging.patch = KrigingPatch::lean;
                           return std::make_unique<Kriging>(kriging);
                         }},
      ReconstructorEntry{"centered_difference",
                         "axis-aligned grids: centered inside, one-sided second order at the boundary",
                         [](JsonReader&) -> std::unique_ptr<VertexGradientReconstructor> {
                           return std::make_unique<CenteredDifference>();
                         }},
      ReconstructorEntry{
          "adaptive", "blend of chandrashekar_garg and kriging, chosen by the data a vertex and frame",
          [](JsonReader&) -> std::unique_ptr<VertexGradientReconstructor> { return std::make_unique<Adaptive>(); }},
  };
  return entries;
}

MadeReconstructor make_reconstructor(const nlohmann::json& specification, const std::string& pointer,
                                     std::span<const ReconstructorEntry> further) {
  std::vector<ReconstructorEntry> entries(reconstructor_registry().begin(), reconstructor_registry().end());
  entries.insert(entries.end(), further.begin(), further.end());
  std::vector<std::string_view> names;
  for (const ReconstructorEntry& entry : entries) names.push_back(entry.name);
  const NamedOptions chosen = read_named_options(specification, pointer, "reconstructor", names);
  const auto entry = std::ranges::find(entries, chosen.name, &ReconstructorEntry::name);
  JsonReader reader(*chosen.options, chosen.pointer);
  MadeReconstructor made{chosen.name, "", entry->make(reader)};
  reader.finish();
  made.options = reader.resolved().dump();
  return made;
}

}  // namespace halfgrad
