// Local feature size: how far the medial axis of a surface is (thesis 4.4.1).
#pragma once

#include <vector>

#include "core/geometry.h"
#include "spatial/seed_tree.h"

namespace bisector {

// The distance to the nearest pole of a dense sample of the surface (Amenta and Bern 1999, "Surface reconstruction by
// Voronoi filtering"). Poles are here the Voronoi vertices whose spheres touch the surface, as the sample's normals
// tell, at places where these differ by more than 60 degrees (the theta-simplified medial axis of Foskey, Lin and
// Manocha 2003). So neither the facets of a mesh of a smooth surface nor slivers of the sample make poles; that of a
// tip is seen up to a sixth too far. The farthest Voronoi vertices alone would not do: on a coarse mesh most of them
// belong to its facets. Edges of a larger dihedral are sharp: there the value falls below the spacing of the sample and
// means little.
class LocalFeatureSize {
 public:
  static constexpr std::size_t kSamples = 60'000;

  // Any soup is valid. Half of the samples are spread by area, half by triangle, for modellers refine where there is
  // detail. Without area, or without poles as in a plane, every value is the diagonal of the box of the vertices.
  explicit LocalFeatureSize(const TriangleMesh& mesh, std::size_t samples = kSamples);
  LocalFeatureSize(const LocalFeatureSize&) = delete;
  LocalFeatureSize& operator=(const LocalFeatureSize&) = delete;

  // In the mesh's unit; at most the diagonal, positive unless p is itself a pole or the mesh a point.
  double operator()(const Vec3& p) const;
  // Of the sample, about; smaller values are not to be relied upon.
  double spacing() const { return spacing_; }
  const std::vector<Vec3>& poles() const { return poles_; }  // distinct, in a spatial order

 private:
  std::vector<Vec3> poles_;
  SeedTree tree_;
  double diagonal_ = 0, spacing_ = 0;
};

// Of each vertex.
std::vector<double> local_feature_size(const TriangleMesh& mesh, std::size_t samples = LocalFeatureSize::kSamples);

}  // namespace bisector
