/* The C interface: the commands of the program, on files or on arrays, with results as arrays.
 *
 * A run takes options, named as those of the command line are (docs/cli.md) and read by the same code, and a mesh, and
 * gives a result; the same options give the same bytes as the program does. Objects are opaque handles. A handle that
 * was freed, is of another kind or NULL is an error, never a crash. Functions return a status; no exception leaves
 * them and none ends the process. All functions may be called from any thread, also on one handle at a time by
 * several; a handle that is freed while it is used lives until that use ends.
 *
 * Numbers are double, or integers of the width that their type says; points are x y z, faces and edges vertex numbers
 * counted from 0, row after row. Arrays that are handed in are copied; arrays that a result hands out are its own and
 * valid until it is freed. Strings are UTF-8 and end with 0. Lengths are in the mesh's unit, angles in degrees. */
#ifndef BISECTOR_C_H
#define BISECTOR_C_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define BISECTOR_C_API __attribute__((visibility("default")))
#else
#define BISECTOR_C_API
#endif

/* Of this interface. It grows when a function or a field is added; programs built for an older one still run. */
#define BISECTOR_C_VERSION 1

typedef enum bisector_status {
  BISECTOR_OK = 0,
  BISECTOR_FAILED = 1,    /* bad input or a failed run */
  BISECTOR_USAGE = 2,     /* a bad option, or options that contradict each other */
  BISECTOR_DEVICE = 3,    /* the device asked for is missing or failed */
  BISECTOR_NO_MEMORY = 4, /* not enough of it */
  BISECTOR_CANCELLED = 5,
  BISECTOR_MISUSE = 6 /* a bad handle, a null pointer, a size that does not fit: a fault of the calling program */
} bisector_status;

typedef struct bisector_mesh bisector_mesh;
typedef struct bisector_options bisector_options;
typedef struct bisector_result bisector_result;
typedef struct bisector_cancel bisector_cancel;

/* BISECTOR_C_VERSION of the library that is loaded; it must not be less than that of the header. */
BISECTOR_C_API int32_t bisector_c_version(void);
/* Of the library: "0.1.0". */
BISECTOR_C_API const char* bisector_version(void);
/* One line about the last call of this thread that did not return BISECTOR_OK: what is wrong, where, what to do. Valid
 * until the thread's next such call. */
BISECTOR_C_API const char* bisector_last_error(void);

/* --- meshes --- */

/* Numbers of each vertex, face, tetrahedron or corner of a mesh under a name. An element is a face, or, of a mesh that
 * has tetrahedra, one of these; corners are those of the faces, in their order. */
typedef enum bisector_site { BISECTOR_VERTEX = 0, BISECTOR_ELEMENT = 1, BISECTOR_CORNER = 2 } bisector_site;

/* What files hold the numbers as. Integers but for colours are not interpolated. */
typedef enum bisector_number {
  BISECTOR_NUMBER_INT8 = 0,
  BISECTOR_NUMBER_UINT8 = 1,
  BISECTOR_NUMBER_INT16 = 2,
  BISECTOR_NUMBER_UINT16 = 3,
  BISECTOR_NUMBER_INT32 = 4,
  BISECTOR_NUMBER_UINT32 = 5,
  BISECTOR_NUMBER_INT64 = 6,
  BISECTOR_NUMBER_UINT64 = 7,
  BISECTOR_NUMBER_FLOAT32 = 8,
  BISECTOR_NUMBER_FLOAT64 = 9
} bisector_number;

typedef struct bisector_attribute {
  const char* name;
  int32_t site;   /* a bisector_site */
  int32_t number; /* a bisector_number */
  size_t components;
  const double* values; /* `components` of each vertex, element or corner */
  size_t count;         /* of all values */
} bisector_attribute;

/* A mesh in memory. `size` is sizeof(bisector_mesh_arrays), set by BISECTOR_MESH_ARRAYS_INIT; what is NULL or 0 is not
 * there. Faces have three corners each, or, with `face_offsets` (face_count + 1 numbers, from 0), any number: face k
 * has the corners face_offsets[k] to face_offsets[k + 1] of `faces`. Neither faces nor tetrahedra: points, for `tree`.
 */
typedef struct bisector_mesh_arrays {
  size_t size;
  const double* vertices; /* vertex_count rows of 3 */
  size_t vertex_count;
  const int64_t* faces;
  size_t face_count;
  const int64_t* face_offsets;
  const int64_t* tets; /* tet_count rows of 4 */
  size_t tet_count;
  const int64_t* labels; /* of each face, e.g. its CAD patch */
  size_t label_count;
  const int64_t* regions; /* of each tetrahedron, e.g. its material */
  size_t region_count;
  const int64_t* feature_edges; /* edge_count rows of 2, kept like those of a file */
  size_t edge_count;
  const bisector_attribute* attributes; /* which `remesh` and `tet` carry to the result */
  size_t attribute_count;
} bisector_mesh_arrays;

#define BISECTOR_MESH_ARRAYS_INIT \
  { sizeof(bisector_mesh_arrays), NULL, 0, NULL, 0, NULL, NULL, 0, NULL, 0, NULL, 0, NULL, 0, NULL, 0 }

/* Copies the arrays and checks them as a file is checked. */
BISECTOR_C_API bisector_status bisector_mesh_from_arrays(const bisector_mesh_arrays* arrays, bisector_mesh** mesh);
/* Names a file, which is read, and read again, by each run that uses the mesh. */
BISECTOR_C_API bisector_status bisector_mesh_from_file(const char* path, bisector_mesh** mesh);
/* NULL is ignored, here and below. */
BISECTOR_C_API bisector_status bisector_mesh_free(bisector_mesh* mesh);

/* --- options --- */

/* For `command`: "remesh", "rvd", "tet", "segment", "tree" or "quality". */
BISECTOR_C_API bisector_status bisector_options_new(const char* command, bisector_options** options);
/* `name` is that of the command line without dashes: "n", "edge-length". The value is a word as there, or NULL for a
 * switch. What a value may be is checked by the run. */
BISECTOR_C_API bisector_status bisector_options_set(bisector_options* options, const char* name, const char* value);
/* Instead of files: seeds (count rows of 3); a density, one positive value for each vertex of the mesh; edge lengths
 * at points (count rows of 3, and `tets`, whose rows of 4 may be missing); the mesh that distances are measured to. */
BISECTOR_C_API bisector_status bisector_options_seeds(bisector_options* options, const double* points, size_t count);
BISECTOR_C_API bisector_status bisector_options_density(bisector_options* options, const double* values, size_t count);
BISECTOR_C_API bisector_status bisector_options_sizes(bisector_options* options, const double* points,
                                                      const double* lengths, size_t count, const int64_t* tets,
                                                      size_t tet_count);
BISECTOR_C_API bisector_status bisector_options_reference(bisector_options* options, const bisector_mesh* mesh);
/* Vertices and faces of the mesh that stay as they are (`remesh`), by index. */
BISECTOR_C_API bisector_status bisector_options_keep_vertices(bisector_options* options, const int64_t* indices,
                                                              size_t count);
BISECTOR_C_API bisector_status bisector_options_keep_faces(bisector_options* options, const int64_t* indices,
                                                           size_t count);
BISECTOR_C_API bisector_status bisector_options_free(bisector_options* options);
/* All options of a command as a JSON array of {name, type, help, group, is_switch}. The text is this thread's, valid
 * until its next call of this function or of bisector_devices(). */
BISECTOR_C_API bisector_status bisector_describe(const char* command, const char** json);

/* --- runs --- */

typedef struct bisector_progress {
  const char* phase; /* what is being done; valid during the call */
  int32_t iteration; /* within the phase, of `iterations` at most; 0: the phase has none */
  int32_t iterations;
  double energy, gradient_norm; /* of the optimiser */
  double fraction;              /* of the whole run, from 0 to 1, estimated; negative: not known */
} bisector_progress;

/* What a call tells its caller while it lasts, from the calling thread. `size` is sizeof(bisector_callbacks), set by
 * BISECTOR_CALLBACKS_INIT; all else may be NULL. The functions must return. */
typedef struct bisector_callbacks {
  size_t size;
  void* user; /* handed to the functions */
  void (*progress)(void* user, const bisector_progress* progress);
  void (*warning)(void* user, const char* line);
  const bisector_cancel* cancel;
} bisector_callbacks;

#define BISECTOR_CALLBACKS_INIT \
  { sizeof(bisector_callbacks), NULL, NULL, NULL, NULL }

/* A flag by which any thread, or a callback, ends a call, which then returns BISECTOR_CANCELLED. */
BISECTOR_C_API bisector_status bisector_cancel_new(bisector_cancel** cancel);
BISECTOR_C_API bisector_status bisector_cancel_request(bisector_cancel* cancel);
BISECTOR_C_API bisector_status bisector_cancel_free(bisector_cancel* cancel);

/* Runs the command of the options; `callbacks` may be NULL, here and below. Options may be used again. */
BISECTOR_C_API bisector_status bisector_run(const bisector_options* options, const bisector_mesh* mesh,
                                            const bisector_callbacks* callbacks, bisector_result** result);

/* --- results --- */

typedef enum bisector_type { BISECTOR_DOUBLE = 0, BISECTOR_UINT32 = 1, BISECTOR_INT32 = 2 } bisector_type;

typedef struct bisector_array {
  const void* data; /* the result's own; NULL if there are no rows */
  bisector_type type;
  size_t rows, columns;
} bisector_array;

/* An array of a result, by name:
 *   remesh   vertices (n, 3), faces (m, 3), labels (m, or none), feature_edges (k, 2), kept (n, or none:
 *            the mesh's vertex that each is, or 0xffffffff); with the option `map` map_faces (n: the mesh's face that
 *            each vertex is on) and map_weights (n, 3: of the corners of a triangle of that)
 *   tet      vertices, tets (t, 4), regions (t, or none), faces (of the boundary and between regions), labels of
 *            these, feature_edges; with the option `order` 2 edge_nodes (k, 3), the nodes on the edges
 *            node_edges (k, 2)
 *   segment  vertices, faces, labels (the region of each face), feature_edges; with the option `polygons`
 *            polygon_vertices, polygon_corners, polygon_offsets, polygon_labels
 *   tree     vertices, faces, labels (the branch of each face); the skeleton's nodes (n, 3), node_radii, node_parents
 *            and node_branches; point_branches (of each point; -1: none)
 *   rvd      seeds, masses, centroids (not a number for a cell that is empty), energies; rdt (k, 3); dual_tets (l, 4;
 *            of a solid); pairs (face or tetrahedron, seed); the cells' polygons as polygon_vertices, polygon_offsets
 *            (corners are consecutive), polygon_cells
 * BISECTOR_FAILED if there is no array of this name. */
BISECTOR_C_API bisector_status bisector_result_array(const bisector_result* result, const char* name,
                                                     bisector_array* array);
/* The attributes of a result of `remesh` or `tet` (bisector/attributes.h says how they are carried), whose names and
 * values are valid until the result is freed. BISECTOR_FAILED if `index` is not below their number. */
BISECTOR_C_API bisector_status bisector_result_attribute_count(const bisector_result* result, size_t* count);
BISECTOR_C_API bisector_status bisector_result_attribute(const bisector_result* result, size_t index,
                                                         bisector_attribute* attribute);
/* The report (docs/cli.md) as JSON, valid until the result is freed. What is in no other output is measured by the
 * first call, which may take a while. */
BISECTOR_C_API bisector_status bisector_result_report(const bisector_result* result,
                                                      const bisector_callbacks* callbacks, const char** json);
/* Writes a file as the program does. `what` is "output" (-o), or another of the command's files: "preview",
 * "feature-output", "map" (remesh), "boundary" (tet), "json", "polygons" (segment), "skeleton", "cylinders", "labels"
 * (tree), "pairs" (rvd); or "report", as JSON, or as a page with 3D views if the name of the file ends in .html. */
BISECTOR_C_API bisector_status bisector_result_save(const bisector_result* result, const char* what, const char* path,
                                                    const bisector_callbacks* callbacks);
BISECTOR_C_API bisector_status bisector_result_free(bisector_result* result);

/* What can compute here, as the report of `bisector devices`. Valid as bisector_describe() says. */
BISECTOR_C_API bisector_status bisector_devices(const char** json);

#ifdef __cplusplus
}
#endif

#endif
