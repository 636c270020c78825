// Fingerprints tell inputs apart by every part of them.
#include "framework/fingerprint.hpp"

#include <gtest/gtest.h>

#include <set>

#include "support/test_meshes.hpp"

namespace halfgrad {
namespace {

TEST(Fingerprint, IsFnv1aOfSizeAndBytes) {
  // By hand, from the constants of FNV-1a: eight bytes of the size, then the byte.
  std::uint64_t expected = 14695981039346656037U;
  for (const int byte : {1, 0, 0, 0, 0, 0, 0, 0, int{'a'}})
    expected = (expected ^ static_cast<std::uint64_t>(byte)) * 1099511628211U;
  EXPECT_EQ(Fingerprint().add("a").value(), expected);
  EXPECT_EQ(Fingerprint().text(), "cbf29ce484222325");
}

TEST(Fingerprint, DiffersWithEveryPartOfTheInput) {
  const Mesh mesh = test::lattice<Triangle>(3, 0.2, 1);
  Points moved = mesh.vertices();
  moved(4, 1) = std::nextafter(moved(4, 1), 2);
  auto blocks = mesh.blocks();
  std::get<ElementBlock<Triangle>>(blocks[0]).cells.row(0).reverseInPlace();
  const std::set<std::uint64_t> values = {
      Fingerprint().value(),
      Fingerprint().add(mesh).value(),
      Fingerprint().add(Mesh(moved, mesh.blocks())).value(),
      Fingerprint().add(Mesh(mesh.vertices(), blocks)).value(),
      Fingerprint().add(mesh.vertices()).value(),
      Fingerprint().add(Points(mesh.vertices().reshaped<Eigen::RowMajor>(2, mesh.num_vertices()))).value(),
      Fingerprint().add("ab").add("c").value(),
      Fingerprint().add("a").add("bc").value(),
      Fingerprint().add("abc").value()};
  EXPECT_EQ(values.size(), 9U);
  EXPECT_EQ(Fingerprint().add(mesh).text(), Fingerprint().add(Mesh(mesh.vertices(), mesh.blocks())).text());
}

}  // namespace
}  // namespace halfgrad
