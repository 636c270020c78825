#include "apps/channels.hpp"

#include <algorithm>

#include "framework/error.hpp"
#include "framework/surface_directions.hpp"

namespace halfgrad::app {

template <class Scalar>
struct Channels<Scalar>::Channel {
  std::string name;
  Kind kind;
  std::unique_ptr<FieldSource> field;
  std::unique_ptr<FrameSink> sink;  // none where the points' own file holds arrays
  Values<double> read;              // of a field
  Values<Scalar> values, result;
};

template <class Scalar>
void Channels<Scalar>::add(std::string name, Kind kind, std::unique_ptr<FieldSource> field) {
  for (const Channel& channel : channels_)
    if (channel.name == name) raise("\"{}\" would be written twice: name the field otherwise", name);
  Channel& channel = channels_.emplace_back();
  channel.name = std::move(name);
  channel.kind = kind;
  channel.field = std::move(field);
}

template <class Scalar>
void Channels<Scalar>::add_directions(const DeformOptions& options, const Binding& binding, const FrameSource& frames) {
  const PointSet& surface = binding.surface;
  const char* option = options.normals ? "--normals" : "--tangents";
  const std::string kind = options.normals.value_or("gradient");
  if (kind != "gradient" && kind != "smooth") raise("--normals {}: expected gradient or smooth", kind);
  smooth_ = kind == "smooth";
  if (binding.gdim() != 3 || frames.num_columns() != 3)
    raise("{}: needs a mesh and frames in three dimensions", option);
  if (surface.faces.num_rows() == 0)
    raise("{}: the points of {} have no faces; give them as a surface, .obj .ply .stl .vtk .vtp or .vtu", option,
          options.bind.points.string());
  normals_ = point_normals(surface.points, surface.faces);
  add("normals", Kind::normals);
  if (!options.tangents) return;

  Points from_uv;
  if (surface.corner_uv.rows() > 0)
    from_uv = point_tangents(surface.points, surface.faces, surface.corner_uv, normals_);
  constexpr std::array<std::string_view, 1> names = {"tangents"};
  if (const PointArray* own = find_array_like(surface.arrays, names)) {
    if (own->values.cols() != 3 && own->values.cols() != 4)
      raise("{}: \"{}\" has {} columns, expected 3, or 4 with the handedness", options.bind.points.string(), own->name,
            own->values.cols());
    tangents_ = orthonormal_tangents(own->values, normals_, from_uv);
    tangents_from_ = own->name;
  } else if (from_uv.rows() > 0) {
    tangents_ = std::move(from_uv);
  } else {
    raise(
        "--tangents: {} has neither tangents nor texture coordinates; expected \"vt\" in an .obj, s and t (or u and v) "
        "in a .ply, point data \"tangents\" or \"uv\" in a .vtp or .vtu",
        options.bind.points.string());
  }
  add("tangents", Kind::tangents);
}

template <class Scalar>
Channels<Scalar>::Channels(const DeformOptions& options, const Binding& binding, const FrameSource& frames,
                           const FrameSinkOptions& sink_options) {
  if (options.gradients) add("gradients", Kind::gradient);
  if (options.stretch) add("stretch", Kind::stretch);
  if (options.normals || options.tangents) add_directions(options, binding, frames);
  for (const std::string& spec : options.fields) {
    auto field = std::make_unique<FieldSource>(spec, options.bind.rest, frames);
    const std::string name = field->name();
    add(name, Kind::field, std::move(field));
  }
  if (options.out.extension() == ".pvd") {
    // What the surface came with goes through unchanged, unless a computed array takes its place.
    for (const PointArray& array : binding.surface.arrays)
      if (array.name != tangents_from_ &&
          std::ranges::none_of(channels_, [&](const Channel& channel) { return channel.name == array.name; }))
        arrays_.push_back(array);
    for (const Channel& channel : channels_) arrays_.push_back({channel.name, {}});
    return;
  }
  for (Channel& channel : channels_)
    channel.sink = create_frames(
        options.out.parent_path() / (options.out.stem().string() + "." + channel.name + ".npy"), {}, sink_options);
}

template <class Scalar>
Channels<Scalar>::~Channels() = default;

template <class Scalar>
Index Channels<Scalar>::num_resumable(Index most) const {
  for (const Channel& channel : channels_)
    if (channel.sink) most = std::min(most, channel.sink->num_resumable());
  return most;
}

template <class Scalar>
void Channels<Scalar>::resume(Index num_frames) {
  for (Channel& channel : channels_)
    if (channel.sink) channel.sink->resume(num_frames);
}

template <class Scalar>
const Values<Scalar>& Channels<Scalar>::exact_gradient(const Carrier<Scalar>& carrier,
                                                       const Values<Scalar>& positions) {
  if (!exact_is_known_) exact_gradient_ = carrier.gradient(positions);
  exact_is_known_ = true;
  return exact_gradient_;
}

template <class Scalar>
const Values<Scalar>& Channels<Scalar>::directing_gradient(const Carrier<Scalar>& carrier,
                                                           const Values<Scalar>& positions) {
  if (!smooth_) return exact_gradient(carrier, positions);
  if (!smooth_is_known_) smooth_gradient_ = carrier.smooth_gradient(positions);
  smooth_is_known_ = true;
  return smooth_gradient_;
}

template <class Scalar>
std::span<const PointArray> Channels<Scalar>::carry(const Carrier<Scalar>& carrier, const Values<Scalar>& positions,
                                                    Index frame) {
  exact_is_known_ = smooth_is_known_ = false;
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    Channel& channel = channels_[c];
    const Values<Scalar>* result = &channel.result;
    switch (channel.kind) {
      case Kind::gradient:
        result = &exact_gradient(carrier, positions);
        break;
      case Kind::stretch:
        principal_stretches(exact_gradient(carrier, positions), carrier.gdim, channel.result);
        break;
      case Kind::normals:
        carry_normals(directing_gradient(carrier, positions), normals_, channel.result);
        break;
      case Kind::tangents:
        carry_tangents(directing_gradient(carrier, positions), tangents_, channel.result);
        break;
      case Kind::field:
        channel.field->read(frame, channel.read);
        channel.values = channel.read.template cast<Scalar>();
        carrier.evaluate_field(channel.values, channel.result);
        break;
    }
    if (channel.sink)
      channel.sink->write(*result);
    else
      arrays_[arrays_.size() - channels_.size() + c].values = result->template cast<double>();
  }
  return arrays_;
}

template <class Scalar>
void Channels<Scalar>::finish() {
  for (Channel& channel : channels_)
    if (channel.sink) channel.sink->finish();
}

template class Channels<float>;
template class Channels<double>;

}  // namespace halfgrad::app
