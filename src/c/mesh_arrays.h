// Arrays of a caller to meshes, with the checks that files have.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "bisector/c.h"
#include "bisector/mesh.h"
#include "job/job.h"

namespace bisector::c {

// Throw Error for coordinates and indices that no file could have, Misuse for pointers and counts that do not fit.
std::shared_ptr<const job::GivenMesh> mesh_of(const bisector_mesh_arrays& arrays);
std::vector<Vec3> points_of(const char* what, const double* points, std::size_t count);
std::vector<Tetrahedron> tets_of(const char* what, const std::int64_t* tets, std::size_t count, std::size_t vertices);
std::vector<Index> indices_of(const char* what, const std::int64_t* indices, std::size_t count);

}  // namespace bisector::c
