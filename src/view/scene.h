// What the page of a report shows in 3D: meshes or points, and figures of their elements.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "bisector/mesh.h"

namespace bisector::view {

enum class Element { vertex, triangle, tet };
enum class Worst { none, low, high, off_six };

using Colour = std::array<unsigned char, 3>;

// A figure that elements have, on one scale in all models; or a group that they are of.
struct Measure {
  std::string key;  // as in reports, where they have it
  std::string label, unit;
  Element element = Element::triangle;  // groups of points are of those
  Worst worst = Worst::none;
  double least = 0, most = 1;  // of the scale; what is beyond counts as its end
  std::size_t bins = 1;        // of its histogram
  // Of groups, whose numbers are the values: there is no scale then.
  std::vector<std::string> names = {};
  std::vector<Colour> colours = {};  // or empty

  bool is_group() const { return !names.empty(); }
};

// A measure's value at each vertex, triangle or tetrahedron; NaN where there is none.
struct Values {
  std::string key;
  std::vector<double> at;
};

struct Model {
  std::string title, file;
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles = {};      // of tetrahedra their boundary; neither: points
  std::vector<Index> face_of_triangle = {};  // as in TriangleMesh
  std::vector<Tetrahedron> tets = {};
  std::vector<std::array<Index, 2>> lines = {};  // feature edges
  bool edges = true;                             // whether edges of triangles are of interest
  std::vector<Values> values = {};
};

struct Scene {
  std::vector<Measure> measures;
  std::vector<Model> models;
};

Model surface_model(const std::string& title, const std::string& file, const TriangleMesh& mesh);
// `boundary`: the facets of one tetrahedron.
Model solid_model(const std::string& title, const std::string& file, const TetMesh& mesh,
                  const std::vector<Triangle>& boundary);

// Adds the smallest angle, Q and valence of surfaces, and the smallest dihedral angle and radius ratio of tetrahedra.
void measure_shapes(Scene& scene);

// Adds the distance of each of two models' vertices from the other's triangles, in percent of the first one's diagonal.
// Throws Error if one has no area.
void measure_distances(Scene& scene);

// Adds groups that the elements of one of the models are of.
void add_groups(Scene& scene, std::size_t model, const Measure& groups, std::vector<double> values);
// Labels of the models' elements, of each model in turn, where there are any; the same number is the same group.
void add_labels(Scene& scene, Measure groups, const std::vector<std::vector<std::int32_t>>& labels);

// The elements with the worst values, worst first, at most so many.
std::vector<std::size_t> worst_elements(const Measure& measure, const std::vector<double>& values, std::size_t most);

// Whether value a is worse than b: a value is worse than none.
bool is_worse(const Measure& measure, double a, double b);

}  // namespace bisector::view
