// What jobs read, from files or from memory.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "bisector/mesh.h"
#include "job/job.h"

namespace bisector::job {

// A surface, or tetrahedra and their boundary with all of their vertices.
struct Domain {
  std::shared_ptr<const TriangleMesh> surface;
  std::shared_ptr<const TetMesh> tets;  // null: a surface
};

Json size_json(const Domain& domain);

// The surface that is given, or that of the file.
std::shared_ptr<const TriangleMesh> read_surface(const std::string& path, const std::shared_ptr<const GivenMesh>& given,
                                                 Journal& journal);
// The facets that bound tetrahedra, or, with `marks`, the mesh's own boundary triangles with their labels.
Domain read_domain(const std::string& path, const std::shared_ptr<const GivenMesh>& given, bool marks,
                   Journal& journal);

// Throws Error, which names the file, for coordinates that the library does not compute with and for surfaces without
// area.
void require_meshable(const std::string& path, const Domain& domain);

// `count`: how many the options ask for, or 0. Throws Error if there is another number.
std::vector<Vec3> read_seeds(const std::string& path, const Given& given, std::size_t count);

// The density of an attribute's name, or as given. Throws Error if it is not one positive number for each vertex.
std::vector<double> read_density(const std::string& path, const std::string& attribute, const Given& given,
                                 std::size_t vertices);

// Indices of a list in a file, or as given, ascending. Throws Error for those that are not below `count`; `what` is an
// element, as "vertex", `option` the one that names the file.
std::vector<Index> read_kept(const std::string& path, const std::vector<Index>& given, std::size_t count,
                             const char* what, const char* option);

// Warns of attributes of the input that a file of a result has no place for, and of those that tetrahedra do not get
// from a surface. Who uses one as a density, `used`, does not ask for it in the result.
void warn_of_lost_attributes(const std::string& path, const TriangleMesh& surface, const std::string& used,
                             Journal& journal);
void warn_of_lost_attributes(const std::string& path, const Domain& domain, const std::string& used, Journal& journal);

// Folds of a wrap are those of its own triangles: creases are not looked for by themselves there.
void leave_out_folds(const WrapOption& wrap, FeatureOptions& features);

// Wraps a mesh if that is asked for, so that tetrahedra fit into it if they are wanted; without a radius it is about
// the edge length of a mesh of so many vertices, or `edge_length` if that is positive. Warns if labels are lost.
// Returns what the report says about it, null if there is no wrap.
Json wrap_if_asked(const WrapOption& option, const TriangleMesh& mesh, std::size_t vertices, double edge_length,
                   bool tetrahedra, Journal& journal, TriangleMesh& wrapped);

}  // namespace bisector::job
