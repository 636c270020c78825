#include "framework/affine_bones.hpp"

#include "framework/error.hpp"
#include "framework/interpolant.hpp"

namespace halfgrad {

AffineBones affine_bones(const Mesh& mesh, const Embedding& embedding) {
  AffineBones bones;
  bones.vertices = active_vertices(mesh, embedding);
  std::vector<Index> bone_of(static_cast<std::size_t>(mesh.num_vertices()), 0);
  for (std::size_t b = 0; b < bones.vertices.size(); ++b) bone_of[bones.vertices[b]] = static_cast<Index>(b);
  std::size_t most_nodes = 0;
  for (Index cell : embedding.cells)
    if (cell >= 0) most_nodes = std::max(most_nodes, mesh.cell_vertices(cell).size());

  bones.indices.setZero(embedding.num_points(), static_cast<Eigen::Index>(most_nodes));
  bones.weights.setZero(embedding.num_points(), static_cast<Eigen::Index>(most_nodes));
  std::size_t next_outside = 0;
  for (Index p = 0; p < embedding.num_points(); ++p) {
    const Vector* offset = nullptr;
    if (next_outside < embedding.outside.size() && embedding.outside[next_outside].point == p)
      offset = &embedding.outside[next_outside++].offset;
    if (embedding.cells[p] < 0) continue;
    with_cell(mesh, embedding.cells[p], [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
      const ReferencePoint<E> xi = embedding.local.row(p).transpose();
      const NodeVector<E> weights = cell_weights<E>(xi, offset);
      for (int i = 0; i < E::num_nodes; ++i) {
        bones.indices(p, i) = bone_of[block.cells(row, i)];
        bones.weights(p, i) = weights[i];
      }
    });
  }
  return bones;
}

template <class Scalar>
Values<Scalar> bone_transforms(std::span<const Index> bones, const Points& rest, const Values<Scalar>& values,
                               const Values<Scalar>& gradients, double alpha) {
  const Eigen::Index columns = values.cols(), gdim = rest.cols(), num_bones = static_cast<Eigen::Index>(bones.size());
  if (values.rows() != rest.rows())
    raise("deformed positions of {} vertices: the mesh has {}", values.rows(), rest.rows());
  if (alpha != 0 && (gradients.rows() != num_bones || gradients.cols() != columns * gdim))
    raise("vertex gradients of size {} x {}: expected {} x {}, one row a bone", gradients.rows(), gradients.cols(),
          num_bones, columns * gdim);
  Values<Scalar> result(num_bones, columns * (gdim + 1));
  for (Eigen::Index b = 0; b < num_bones; ++b)
    for (Eigen::Index c = 0; c < columns; ++c) {
      double translation = static_cast<double>(values(bones[b], c));
      for (Eigen::Index k = 0; k < gdim; ++k) {
        const double linear = alpha == 0 ? 0 : alpha * static_cast<double>(gradients(b, c * gdim + k));
        result(b, c * (gdim + 1) + k) = static_cast<Scalar>(linear);
        translation -= linear * rest(bones[b], k);
      }
      result(b, c * (gdim + 1) + gdim) = static_cast<Scalar>(translation);
    }
  return result;
}

template Values<float> bone_transforms(std::span<const Index>, const Points&, const Values<float>&,
                                       const Values<float>&, double);
template Values<double> bone_transforms(std::span<const Index>, const Points&, const Values<double>&,
                                        const Values<double>&, double);

}  // namespace halfgrad
