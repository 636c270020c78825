// opensubdiv_stencils FOLDER: moves points by OpenSubdiv with the stencils that `halfgrad export --as stencils` wrote.
//
// The folder holds the arrays of the .npz as raw bytes, NAME.bin (sizes, offsets, indices: int32; weights: double), and
// frame.bin, #vertices x 3 doubles; counts.txt holds the number of control vertices. Written are double.bin, by
// Far::StencilTableReal<double>, and float.bin, by Osd::CpuEvaluator in single precision. Built by programs.py.
#include <opensubdiv/far/stencilTable.h>
#include <opensubdiv/osd/cpuEvaluator.h>
#include <opensubdiv/osd/cpuVertexBuffer.h>

#include <cstdio>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

using namespace OpenSubdiv;

template <class T>
std::vector<T> read(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::runtime_error(path);
  std::vector<T> values(static_cast<std::size_t>(file.tellg()) / sizeof(T));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
  return values;
}

template <class T>
void write(const std::string& path, const T* values, std::size_t count) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(values), static_cast<std::streamsize>(count * sizeof(T)));
}

// OpenSubdiv's table with arrays from outside: its members are open to derived classes.
template <class Real>
struct Table : Far::StencilTableReal<Real> {
  Table(const std::string& folder, int num_control_vertices) : Far::StencilTableReal<Real>(num_control_vertices) {
    this->_sizes = read<int>(folder + "/sizes.bin");
    this->_offsets = read<int>(folder + "/offsets.bin");
    this->_indices = read<int>(folder + "/indices.bin");
    const std::vector<double> weights = read<double>(folder + "/weights.bin");
    this->_weights.assign(weights.begin(), weights.end());
  }
};

// What UpdateValues asks of a value.
struct Position {
  double x[3];
  void Clear() { x[0] = x[1] = x[2] = 0; }
  void AddWithWeight(const Position& other, double weight) {
    for (int k = 0; k < 3; ++k) x[k] += weight * other.x[k];
  }
};

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::string folder = argv[1];
  int num_vertices = 0;
  std::ifstream(folder + "/counts.txt") >> num_vertices;
  const std::vector<Position> vertices = read<Position>(folder + "/frame.bin");

  const Table<double> exact(folder, num_vertices);
  std::vector<Position> points(static_cast<std::size_t>(exact.GetNumStencils()));
  exact.UpdateValues(vertices.data(), points.data());
  write(folder + "/double.bin", points.data(), points.size());

  const Table<float> single(folder, num_vertices);
  const std::unique_ptr<Osd::CpuVertexBuffer> from(Osd::CpuVertexBuffer::Create(3, num_vertices)),
      to(Osd::CpuVertexBuffer::Create(3, single.GetNumStencils()));
  std::vector<float> positions;
  for (const Position& vertex : vertices) positions.insert(positions.end(), vertex.x, vertex.x + 3);
  from->UpdateData(positions.data(), 0, num_vertices);
  const Osd::BufferDescriptor layout(0, 3, 3);
  if (!Osd::CpuEvaluator::EvalStencils(from.get(), layout, to.get(), layout, &single)) return 1;
  write(folder + "/float.bin", to->BindCpuBuffer(), 3 * static_cast<std::size_t>(single.GetNumStencils()));
  std::printf("OpenSubdiv %d.%d.%d\n", OPENSUBDIV_VERSION_MAJOR, OPENSUBDIV_VERSION_MINOR, OPENSUBDIV_VERSION_PATCH);
}
