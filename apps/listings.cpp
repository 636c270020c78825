#include "apps/listings.hpp"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "apps/diagnosis.hpp"
#include "experiments/fields.hpp"
#include "framework/error.hpp"
#include "framework/interpolation_rule.hpp"
#include "framework/io/mesh_file.hpp"
#include "framework/mesh.hpp"
#include "framework/scattered_transfer.hpp"
#include "reconstruction/registry.hpp"

namespace halfgrad::app {

// Keys in the order in which they are set: these objects are read by people too.
using json = nlohmann::ordered_json;

namespace {

json element_list() {
  json list = json::array();
  Elements::for_each([&]<class E>() {
    list.push_back({{"name", E::name}, {"dim", E::dim}, {"nodes", E::num_nodes}, {"vtk_id", E::vtk_id}});
  });
  return list;
}

template <class Entries>
json named_list(const Entries& entries) {
  json list = json::array();
  for (const auto& entry : entries) list.push_back({{"name", entry.name}, {"summary", entry.summary}});
  return list;
}

}  // namespace

void list(const std::string& what, bool as_json) {
  json all;
  all["elements"] = element_list();
  all["reconstructors"] = named_list(reconstructor_registry());
  all["interpolants"] = named_list(named_rules());
  for (json& entry : named_list(scattered_rules())) all["interpolants"].push_back(entry);
  all["fields"] = named_list(field_registry());
  if (!what.empty()) {
    if (!all.contains(what)) raise("list {}: expected elements, reconstructors, interpolants or fields", what);
    all = json{{what, all[what]}};
  }
  if (as_json) {
    fmt::print("{}\n", all.dump(2));
    return;
  }
  for (const auto& [group, rows] : all.items()) {
    fmt::print("{}\n", group);
    for (const json& row : rows) {
      const std::string name = row["name"];
      if (group == "elements")
        fmt::print("  {:<20} dimension {}, {} nodes, VTK type {}\n", name, row["dim"].get<int>(),
                   row["nodes"].get<int>(), row["vtk_id"].get<int>());
      else
        fmt::print("  {:<20} {}\n", name, row["summary"].get<std::string>());
    }
  }
}

void info(const std::filesystem::path& path, const std::vector<std::string>& limits, bool as_json) {
  const Limits accepted(limits);
  const Mesh mesh = read_mesh(path);
  const MeshReport report = inspect(mesh);
  const std::vector<Fault> faults = mesh_faults(mesh, report);
  json facts;
  facts["file"] = path.string();
  facts["dimension"] = mesh.gdim();
  facts["vertices"] = mesh.num_vertices();
  facts["cells"] = mesh.num_cells();
  facts["blocks"] = json::array();
  std::map<std::string, Index> elements;
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    facts["blocks"].push_back({{"element", E::name}, {"cells", block.cells.rows()}});
  });
  std::vector<double> low, high;
  for (int k = 0; k < mesh.gdim(); ++k) {
    low.push_back(mesh.num_vertices() > 0 ? mesh.vertices().col(k).minCoeff() : 0);
    high.push_back(mesh.num_vertices() > 0 ? mesh.vertices().col(k).maxCoeff() : 0);
  }
  facts["bounds"] = {{"low", low}, {"high", high}};
  facts["volume"] = report.volume;
  facts["edge"] = {{"min", report.min_edge}, {"mean", report.mean_edge}, {"max", report.max_edge}};
  facts["quality"] = {{"min", report.min_quality}, {"mean", report.mean_quality}};
  facts["boundary_facets"] = report.num_boundary_facets;
  facts.update(to_json(faults));
  if (as_json) {
    fmt::print("{}\n", facts.dump(2));
    return accepted.check(path, faults);
  }
  fmt::print("{}: {} vertices in {} dimensions, {} cells{}\n", path.string(), mesh.num_vertices(), mesh.gdim(),
             mesh.num_cells(), mesh.is_surface() ? " of a surface" : "");
  for (const json& block : facts["blocks"])
    fmt::print("  {:<26} {}\n", block["element"].get<std::string>(), block["cells"].get<Index>());
  fmt::print("  {:<26} ({:.6g}) to ({:.6g})\n", "bounds", fmt::join(low, ", "), fmt::join(high, ", "));
  fmt::print("  {:<26} {:.6g}\n",
             mesh.gdim() == 2 || mesh.is_surface() ? "area"
             : mesh.gdim() == 1                    ? "length"
                                                   : "volume",
             report.volume);
  fmt::print("  {:<26} {:.4g} to {:.4g}, mean {:.4g}\n", "edges", report.min_edge, report.max_edge, report.mean_edge);
  fmt::print("  {:<26} least {:.3g}, mean {:.3g} (|det J| over edge lengths, 1 is best)\n", "quality",
             report.min_quality, report.mean_quality);
  fmt::print("  {:<26} {}\n", "boundary facets", report.num_boundary_facets);
  fmt::print("{}", fault_lines(faults));
  accepted.check(path, faults);
}

}  // namespace halfgrad::app
