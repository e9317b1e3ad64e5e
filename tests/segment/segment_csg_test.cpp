#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "bisector/segment.h"
#include "support/csg.h"

namespace bisector::test {
namespace {

struct Generator {
  std::string name;
  CsgModel (*make)(std::size_t, double, std::uint64_t);
};
const Generator kGenerators[] = {{"csg_part", csg_part}, {"turned_part", turned_part}};

SegmentResult segment_truly(const CsgModel& model) {
  SegmentOptions options;
  options.proxies = model.primitives.size();
  return segment(model.mesh, options);
}

TEST(SegmentCsg, FindsEverySurfaceOfAPart) {
  for (const Generator& generator : kGenerators) {
    SCOPED_TRACE(generator.name);
    const CsgModel model = generator.make(20000, 0, 1);
    const SegmentResult result = segment_truly(model);
    EXPECT_GE(share_right(model, result.labels), 0.99);
    const double diagonal = bounding_box(model.mesh.vertices).diagonal();
    const std::vector<Index> regions = matching_regions(model, result.labels);
    for (std::size_t k = 0; k < regions.size(); ++k) {
      ASSERT_LT(regions[k], result.regions.size());
      const Primitive& found = result.regions[regions[k]].proxy;
      EXPECT_EQ(type_of(found), type_of(model.primitives[k])) << "surface " << k << ": " << name_of(type_of(found));
      EXPECT_LT(parameter_difference(model.primitives[k], found, diagonal), 1e-3 * diagonal) << "surface " << k;
    }
  }
}

TEST(SegmentCsg, FindsEverySurfaceOfANoisyPart) {
  for (const Generator& generator : kGenerators) {
    SCOPED_TRACE(generator.name);
    const CsgModel model = generator.make(20000, 1e-3, 2);
    const SegmentResult result = segment_truly(model);
    EXPECT_GE(share_right(model, result.labels), 0.97);
    const std::vector<Index> regions = matching_regions(model, result.labels);
    for (std::size_t k = 0; k < regions.size(); ++k) {
      ASSERT_LT(regions[k], result.regions.size());
      const SurfaceType type = type_of(result.regions[regions[k]].proxy);
      EXPECT_EQ(type, type_of(model.primitives[k])) << "surface " << k << ": " << name_of(type);
    }
  }
}

TEST(SegmentCsg, ProjectionUndoesNoise) {
  const CsgModel noisy = turned_part(20000, 1e-3, 3);
  SegmentOptions options;
  options.proxies = noisy.primitives.size();
  options.project = true;
  const SegmentResult result = segment(noisy.mesh, options);
  ASSERT_EQ(result.projected.size(), noisy.mesh.vertices.size());
  double before = 0, after = 0;
  for (std::size_t t = 0; t < noisy.labels.size(); ++t)
    for (const Index v : noisy.mesh.triangles[t]) {
      const double d = distance(noisy.primitives[noisy.labels[t]], noisy.mesh.vertices[v]);
      const double e = distance(noisy.primitives[noisy.labels[t]], result.projected[v]);
      before += d * d;
      after += e * e;
    }
  EXPECT_LT(after, 0.25 * before);
}

}  // namespace
}  // namespace bisector::test
