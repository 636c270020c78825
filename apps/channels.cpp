#include "apps/channels.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>

#include "framework/error.hpp"
#include "framework/io/field_source.hpp"

namespace halfgrad::app {

namespace {

// Area-weighted normals at the points of a surface, #points × 3; zero where a point has no face.
Points surface_normals(const PointSet& surface) {
  Points normals = Points::Zero(surface.points.rows(), 3);
  for (Index f = 0; f < surface.faces.num_rows(); ++f) {
    const std::span<const Index> face = surface.faces[f];
    Eigen::RowVector3d area = Eigen::RowVector3d::Zero();
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      const Eigen::RowVector3d a = surface.points.row(face[i]) - surface.points.row(face[0]);
      const Eigen::RowVector3d b = surface.points.row(face[i + 1]) - surface.points.row(face[0]);
      area += a.cross(b);
    }
    for (Index v : face) normals.row(v) += area;
  }
  for (Eigen::Index p = 0; p < normals.rows(); ++p)
    if (const double length = normals.row(p).norm(); length > 0) normals.row(p) /= length;
  return normals;
}

// n ∝ cof(F) N, which is F⁻ᵀN up to a factor and needs no inverse; gradients are #points × 9.
Values<double> carried_normals(const Values<double>& gradients, const Points& normals) {
  Values<double> result(normals.rows(), 3);
  for (Eigen::Index p = 0; p < normals.rows(); ++p) {
    const auto F = gradients.row(p);
    const Eigen::Vector3d r0(F[0], F[1], F[2]), r1(F[3], F[4], F[5]), r2(F[6], F[7], F[8]);
    const Eigen::Vector3d N = normals.row(p).transpose();
    Eigen::Vector3d n(r1.cross(r2).dot(N), r2.cross(r0).dot(N), r0.cross(r1).dot(N));
    if (const double length = n.norm(); length > 0) n /= length;
    result.row(p) = n.transpose();
  }
  return result;
}

// Singular values of F, greatest first: #points × gdim from #points × (#columns · gdim).
Values<double> principal_stretches(const Values<double>& gradients, int gdim) {
  const Eigen::Index columns = gradients.cols() / gdim;
  Values<double> result(gradients.rows(), gdim);
  for (Eigen::Index p = 0; p < gradients.rows(); ++p) {
    const Eigen::Map<const Values<double>> F(gradients.row(p).data(), columns, gdim);
    const Eigen::MatrixXd right = F.transpose() * F;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(right, Eigen::EigenvaluesOnly);
    result.row(p) = solver.eigenvalues().reverse().cwiseMax(0).cwiseSqrt().transpose();
  }
  return result;
}

}  // namespace

struct Channels::Channel {
  enum class Kind { gradient, stretch, normals, smooth_normals, field };
  std::string name;
  Kind kind;
  std::unique_ptr<FieldSource> field;
  std::unique_ptr<FrameSink> sink;  // none where the points' own file holds arrays
};

Channels::Channels(const DeformOptions& options, const Binding& binding, const FrameSource& frames,
                   const FrameSinkOptions& sink_options) {
  using Kind = Channel::Kind;
  const auto add = [&](std::string name, Kind kind, std::unique_ptr<FieldSource> field = nullptr) {
    for (const auto& channel : channels_)
      if (channel->name == name) raise("\"{}\" would be written twice: name the field otherwise", name);
    channels_.push_back(std::make_unique<Channel>(std::move(name), kind, std::move(field)));
  };
  if (options.gradients) add("gradients", Kind::gradient);
  if (options.stretch) add("stretch", Kind::stretch);
  if (options.normals) {
    if (*options.normals != "gradient" && *options.normals != "smooth")
      raise("--normals {}: expected gradient or smooth", *options.normals);
    if (binding.gdim() != 3 || frames.num_columns() != 3)
      raise("--normals: needs a mesh and frames in three dimensions");
    if (binding.surface.faces.num_rows() == 0) raise("--normals: the points have no faces");
    normals_ = surface_normals(binding.surface);
    add("normals", *options.normals == "smooth" ? Kind::smooth_normals : Kind::normals);
  }
  for (const std::string& spec : options.fields) {
    auto field = std::make_unique<FieldSource>(spec, options.bind.rest, frames);
    const std::string name = field->name();
    add(name, Kind::field, std::move(field));
  }
  if (options.out.extension() == ".pvd") {
    // What the surface came with goes through unchanged, unless a computed array bears its name.
    for (const PointArray& array : binding.surface.arrays)
      if (std::ranges::none_of(channels_, [&](const auto& channel) { return channel->name == array.name; }))
        constant_.push_back(array);
    return;
  }
  for (const auto& channel : channels_)
    channel->sink = create_frames(
        options.out.parent_path() / (options.out.stem().string() + "." + channel->name + ".npy"), {}, sink_options);
}

Channels::~Channels() = default;

Index Channels::num_resumable(Index most) const {
  for (const auto& channel : channels_)
    if (channel->sink) most = std::min(most, channel->sink->num_resumable());
  return most;
}

void Channels::resume(Index num_frames) {
  for (const auto& channel : channels_)
    if (channel->sink) channel->sink->resume(num_frames);
}

template <class Scalar>
std::vector<PointArray> Channels::carry(const Carrier<Scalar>& carrier, const Values<Scalar>& positions, Index frame) {
  using Kind = Channel::Kind;
  std::vector<PointArray> arrays = constant_;
  Values<Scalar> gradients, smooth;
  const auto exact = [&]() -> const Values<Scalar>& {
    if (gradients.size() == 0) gradients = carrier.gradient(positions);
    return gradients;
  };
  for (const auto& channel : channels_) {
    Values<Scalar> result;
    switch (channel->kind) {
      case Kind::gradient:
        result = exact();
        break;
      case Kind::stretch:
        result = principal_stretches(exact().template cast<double>(), carrier.gdim).template cast<Scalar>();
        break;
      case Kind::normals:
        result = carried_normals(exact().template cast<double>(), normals_).template cast<Scalar>();
        break;
      case Kind::smooth_normals:
        smooth = carrier.smooth_gradient(positions);
        result = carried_normals(smooth.template cast<double>(), normals_).template cast<Scalar>();
        break;
      case Kind::field: {
        Values<double> values;
        channel->field->read(frame, values);
        result = carrier.evaluate_field(values.template cast<Scalar>());
        break;
      }
    }
    if (channel->sink)
      channel->sink->write(result);
    else
      arrays.push_back({channel->name, result.template cast<double>()});
  }
  return arrays;
}

template std::vector<PointArray> Channels::carry(const Carrier<float>&, const Values<float>&, Index);
template std::vector<PointArray> Channels::carry(const Carrier<double>&, const Values<double>&, Index);

void Channels::finish() {
  for (const auto& channel : channels_)
    if (channel->sink) channel->sink->finish();
}

}  // namespace halfgrad::app
