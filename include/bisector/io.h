// Mesh files and scans. docs/cli.md has a table of what each format of meshes keeps.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bisector/context.h"
#include "bisector/export.h"
#include "bisector/mesh.h"
#include "bisector/second_order.h"

namespace bisector {

// --- formats of meshes ---

// What can be done with files of one extension.
struct FileFormat {
  enum class Labels { none, named, all };  // of faces: those with names only are written where it is `named`

  std::string_view extension;  // in lower case, with the dot
  bool reads_surfaces = false, writes_surfaces = false, writes_polygons = false;
  bool reads_tets = false, writes_tets = false, writes_second_order = false;
  Labels labels = Labels::none;
};

// All of them: what read_mesh, write_mesh, write_polygons, read_tet_mesh and write_tet_mesh take.
BISECTOR_API const std::vector<FileFormat>& file_formats();

// The extensions of which one of the above is true, in their order.
BISECTOR_API std::vector<std::string> extensions_that(bool FileFormat::*use);

// Names of the attributes that a file of this name, by its extension, has no place for; all of them if no format is
// known by it.
BISECTOR_API std::vector<std::string> lost_attributes(const std::string& path,
                                                      const std::vector<Attribute>& attributes);

// ".off, .obj or .ply".
BISECTOR_API std::string listed(const std::vector<std::string>& names);

// --- surfaces ---

// Reads a mesh by its file name's extension. Polygons are split into triangles (face_of_triangle tells from which
// face), triangle strips too, identical STL corners are merged. Vertices that no face uses and zero-area triangles are
// kept, so that indices stay those of the file; each kind is counted in one warning, and so are polygons that were
// split and what follows the last face. Formats:
//   .off    text, each item on a line of its own or all as one stream of numbers, and binary; what points and faces
//           have beside coordinates and corners is ignored.
//   .obj    labels: each pair of `g` and `usemtl` gets the next number from 0 as its first face appears, if there are
//           several. Feature edges: lines `l`. Attributes: `color` of vertices, from three numbers behind the
//           coordinates of all of them; `texcoord` from `vt`, of vertices if each has only one, else of corners (0 0
//           where there is none). Normals, those of the input's facets, are ignored.
//   .ply    text and binary; faces and `tristrips`. Labels: the face property `label` of any integer type (from 2^31 on
//           they wrap around). Feature edges: `vertex1 vertex2` of the element `edge`. Attributes: all other scalar
//           properties of vertices and faces, of which red, green, blue (and alpha) one after the other become
//           `color`, nx, ny, nz `normal`, u, v or s, t `texcoord`, and NAME_0, NAME_1, ... NAME; and the faces' list
//           `texcoord`, of corners.
//   .stl    text and binary. Labels: solids of different names, if there are several.
//   .3mf    objects as built, with their transforms. Labels: each pair of an object in the build and a material or
//           colour, if there are several. `unit` is that of the file.
//   .vtp    one piece: ASCII, base64, raw, zlib-compressed or not; polygons and strips. Labels: cell data `label` or
//           what else read_tet_mesh takes. Feature edges: lines. Attributes: other point and cell data.
//   others  those of read_tet_mesh, without tetrahedra.
// Where all names of groups, solids or materials are label_K, as write_mesh calls them, or region_K or branch_K, labels
// are these numbers; else they have the file's names. Feature edges are ascending, each once and with the lower vertex
// first; those that are not edges of a triangle are left out with a warning. Throws Error, naming the file and the
// line, vertex or face (counted from 0), for: a missing, empty, damaged or truncated file, an unknown format, NaN or
// infinite coordinates, coordinates beyond 1e100, an index out of range, a face of fewer than three corners, no face at
// all. Memory is bounded by the file's size (unpacked, by at most 1100 times that), not by its counts.
BISECTOR_API TriangleMesh read_mesh(const std::string& path, const Context& context = {});

// How labels and feature edges are written, as far as a format leaves a choice.
struct WriteOptions {
  // Labels without a name of their own are called PREFIX_K, or, where the labels 0, 1, ... have `names`, PREFIX_K_NAME.
  std::string prefix = "label";  // label, region or branch; others are not read back as labels
  std::vector<std::string> names = {};
  // Red, green, blue of the labels 0, 1, ... in 3MF and glTF; empty: any that tell them apart.
  std::vector<std::array<unsigned char, 3>> colours = {};
  bool lines = false;  // OBJ: feature edges as lines `l`, which CGAL's reader and others refuse
};

// Writes a mesh by extension, with as many of 17 significant digits as it takes to read back the same bits; STL and
// glTF hold floats. Labels become the face property `int label` in PLY, groups in OBJ, materials in 3MF and glTF,
// solids of an ASCII file in STL if the mesh has names for them (else it is binary), cell data in VTP, and what
// write_tet_mesh makes of them; feature edges the element `edge` in PLY, lines in OBJ if asked for and in VTP; OFF
// holds neither. Attributes become what read_mesh reads, as far as lost_attributes says; glTF has colours, normals and
// texture coordinates, with a vertex for each of several of these at one place. The file appears under its name only
// when complete. Throws Error, also for coordinates that are not finite or beyond the format's range, indices out of
// range, labels that are not one per triangle and labels without a name or colour among those given.
BISECTOR_API void write_mesh(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options = {});

// A mesh of polygons with one integer label and one colour each.
struct PolygonMesh {
  std::vector<Vec3> vertices;
  Csr<Index> polygons;
  std::vector<Index> labels;                             // one per polygon, or empty; property "label"
  std::vector<std::array<unsigned char, 3>> colours;     // one per polygon, or empty: red, green, blue
  std::vector<std::array<Index, 2>> feature_edges = {};  // element "edge", or empty
};
// Writes polygons by extension, as write_mesh does: binary PLY with labels and colours, OBJ with labels as groups, VTP
// with labels, OFF with neither. Throws Error as write_mesh does, and for other formats.
BISECTOR_API void write_polygons(const std::string& path, const PolygonMesh& mesh, const WriteOptions& options = {});

// Polyhedra with vertices of their own, each told which cell of a diagram and which tetrahedron it is a part of.
struct PolyhedronMesh {
  std::vector<Vec3> vertices;
  Csr<Index> faces;                // corners, counter-clockwise seen from outside
  Csr<Index> polyhedra;            // their faces
  std::vector<Index> cells, tets;  // of each polyhedron
};
// Writes them as VTU, with cell data `cell` and `tet`. Throws Error as write_mesh does.
BISECTOR_API void write_polyhedra(const std::string& path, const PolyhedronMesh& mesh);

// Reads a number for each vertex from a scalar property of a PLY file's element `vertex` or from a VTP file's point
// data. Throws Error, listing what is there, if `name` is not among it, and for other formats and values that are not
// finite.
BISECTOR_API std::vector<double> read_vertex_attribute(const std::string& path, const std::string& name);

// What a Medit file says is to stay as it is: RequiredVertices, RequiredEdges and RequiredTriangles. Indices are those
// that read_mesh gives, ascending, each once.
struct RequiredElements {
  std::vector<Index> vertices;
  std::vector<std::array<Index, 2>> edges;  // lower vertex first
  std::vector<Index> triangles;

  bool empty() const { return vertices.empty() && edges.empty() && triangles.empty(); }
};
// None for files of other formats. Throws Error as read_mesh does, and for an index that is out of range.
BISECTOR_API RequiredElements read_required(const std::string& path);

// Reads "a b" lines, vertex indices counted from 0 as in the mesh's file; '#' starts a comment, further columns are
// ignored. Ascending, each edge once and with the lower vertex first. Throws Error, naming the line, for what is not an
// edge of the mesh.
BISECTOR_API std::vector<std::array<Index, 2>> read_feature_edges(const std::string& path, const TriangleMesh& mesh);

// Reads indices of a mesh's elements, counted from 0, any number in a line; '#' starts a comment. Ascending, each once.
// Throws Error, naming the line, for what is not below `count`; `what` is an element, as "vertex", for the message.
BISECTOR_API std::vector<Index> read_indices(const std::string& path, std::size_t count, const std::string& what);

// Writes what read_feature_edges reads. Throws Error.
BISECTOR_API void write_feature_edges(const std::string& path, const std::vector<std::array<Index, 2>>& edges);

// --- scans ---

struct PointCloud {
  std::vector<Vec3> points;
  std::vector<std::uint8_t> classification;  // LAS: the class of each point (2: ground); empty: the file has none
  double unit = 0;                           // of the coordinates, in metres; 0: the file does not say
};

// Reads a scan by its file name's extension.
//   .las  LAS 1.0 to 1.4 with point formats 0 to 10, not compressed. Points classified as noise (7 and 18) or flagged
//         as withheld are left out, each kind with a warning; the classes of LAS 1.0, which defines none, are not read.
//         The unit is that of the coordinate system (GeoTIFF keys or WKT); where z has another one, z is converted,
//         with a warning.
//   .pts  lines "x y z", further columns ignored, after a line with their number; several scans may follow each other.
//   .pcd  PCD 0.5 to 0.7, ASCII, binary or binary_compressed. Points with NaN or infinite coordinates, which had no
//         return, are left out with a warning.
//   .ply  the vertices, with or without faces.
// Others are read as lines "x y z"; '#' starts a comment, further columns are ignored.
// Throws Error, naming the file and the line, byte or point (counted from 0), for: a missing, empty, damaged or
// truncated file, counts that do not match, compressed LAS (.laz), coordinates in degrees, NaN and infinite coordinates
// (but for PCD), coordinates beyond 1e100, no point at all. Memory is bounded by the file's size, not by its counts.
BISECTOR_API PointCloud read_point_cloud(const std::string& path, const Context& context = {});

// The points alone, without warnings.
BISECTOR_API std::vector<Vec3> read_points(const std::string& path);

// --- tetrahedral meshes ---

// Whether a file name's extension is one of those below. Such files may hold triangles only.
BISECTOR_API bool is_tet_format(const std::string& path);

// Reads a mesh by its file name's extension: Medit .mesh (ASCII) and .meshb (binary, versions 1 to 4); Gmsh .msh of
// version 2.2 or 4.1, ASCII and binary; legacy .vtk with an unstructured grid, ASCII and binary; .vtu with one piece,
// ASCII, base64, raw, zlib-compressed or not. Tetrahedra become `tets`, turned positive by the exact sign (those of no
// volume stay and are counted in a warning), triangles `boundary`, turned outward where they have a tetrahedron on one
// side only, edges `feature_edges`, ascending, each once and with the lower vertex first. A file without tetrahedra
// gives an empty `tets`; surface_of_marks makes it a surface.
//
// Regions and labels are the refs of Medit; the first physical group of Gmsh, with its name, or, where there are none,
// the elementary entity (where all names are region_K or label_K, these numbers without names); in VTK the cell data
// `region` or `label` of tetrahedra, `label` of triangles (or what other programs write: medit:ref, gmsh:physical,
// gmsh:geometrical, CellEntityIds). Where all are 0 there are none. Vertices keep the file's order, in Gmsh that of
// their tags, and stay though nothing uses them.
//
// Throws Error, naming the file and the line, byte, vertex or cell, for: a missing, empty, damaged or truncated file,
// other formats and versions, NaN or infinite coordinates and those beyond 1e100, an index out of range, a repeated
// corner, and elements that are neither tetrahedra, triangles, edges nor points. Elements of second order (not of
// Medit) are read by their corners, with a warning; their nodes stay as vertices that nothing uses. Memory is bounded
// by the file's size. Attributes are what else VTK's files have of points and tetrahedra.
BISECTOR_API TetMesh read_tet_mesh(const std::string& path, const Context& context = {});

// Writes Medit .mesh (ASCII) or .meshb (binary, version 2, beyond 2 GiB 3 or 4), Gmsh .msh (4.1, ASCII) or .vtu
// (base64) by extension; read_tet_mesh brings back the same bits. In Gmsh each region is a volume, each label a
// surface, and feature edges are curves between their branches, with physical groups of the mesh's names, region_K and
// label_K where it has none, and features (volume and boundary where there are no numbers). Groups have the marks as
// tags, or, if some mark is not positive, the next number from 1. With an `order` that is not empty elements are of
// second order, in .msh and .vtu; the nodes follow the vertices in its order. The file appears under its name only when
// complete. Throws Error, also for a mesh whose indices, coordinates or numbers of marks are unsound, and for an order
// that is not that of the mesh.
BISECTOR_API void write_tet_mesh(const std::string& path, const TetMesh& mesh, const SecondOrder& order = {});

// A number for each vertex: the scalar point data `name` of a .vtk or .vtu file, or, for a .mesh or .meshb file, the
// first scalar of the Medit solution beside it (NAME.sol; for NAME.meshb NAME.solb, if it is there; `name` does not
// matter). Throws Error as read_tet_mesh, and for values that are not finite or not one per vertex.
BISECTOR_API std::vector<double> read_tet_attribute(const std::string& path, const std::string& name);

// The marked triangles as a surface with all vertices, labels and those feature edges that are edges of it.
BISECTOR_API TriangleMesh surface_of_marks(const TetMesh& mesh);

}  // namespace bisector
