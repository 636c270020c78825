// Results as files: JSON, CSV, and pictures for ParaView.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "experiments/point_source.hpp"
#include "experiments/results.hpp"
#include "framework/gradient_stencils.hpp"

namespace halfgrad {

/// What a picture of the finest level shows.
struct LevelPicture {
  Mesh mesh;
  PointCloud cloud;
  std::vector<std::pair<std::string, GradientStencilTable>> stencils;  ///< by reconstructor
  std::vector<std::pair<ResultRow, Eigen::VectorXd>> errors;           ///< a rule of the last frame, an error a point
};

/// The machine and compiler, a JSON object.
std::string machine_facts();

/// Writes stencils.vtu (the mesh with each vertex's stencil diagnostics) and errors.vtp (the points with each rule's
/// error), and appends their names.
void write_pictures(const std::filesystem::path& directory, const LevelPicture& picture,
                    std::vector<std::string>& files);

/// Writes a text whole or not at all, and appends its name.
void write_report(const std::filesystem::path& path, const std::string& text, std::vector<std::string>& files);

}  // namespace halfgrad
