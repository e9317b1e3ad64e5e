/* The C interface as a program in C sees it: statuses, messages, handles and arrays. Usage: c_test FOLDER */
#include <bisector/c.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

#define EXPECT(condition)                                                                       \
  do {                                                                                          \
    if (!(condition)) {                                                                         \
      fprintf(stderr, "%s:%d: not so: %s (%s)\n", __FILE__, __LINE__, #condition, bisector_last_error()); \
      ++failures;                                                                               \
    }                                                                                           \
  } while (0)

static int says(const char* words) { return strstr(bisector_last_error(), words) != NULL; }

/* A cube of n x n squares a side, as polygons of four corners. */
enum { N = 6, SIDE_VERTICES = (N + 1) * (N + 1), VERTICES = 6 * SIDE_VERTICES, FACES = 6 * N * N };
static double vertices[3 * VERTICES];
static int64_t corners[4 * FACES], offsets[FACES + 1];

static void make_cube(void) {
  for (int side = 0, v = 0; side < 6; ++side) {
    const int axis = side / 2, high = side % 2;
    for (int i = 0; i <= N; ++i)
      for (int j = 0; j <= N; ++j, ++v) {
        vertices[3 * v + axis] = high;
        vertices[3 * v + (axis + 1) % 3] = (double)(high ? i : j) / N;
        vertices[3 * v + (axis + 2) % 3] = (double)(high ? j : i) / N;
      }
  }
  for (int side = 0, f = 0; side < 6; ++side)
    for (int i = 0; i < N; ++i)
      for (int j = 0; j < N; ++j, ++f) {
        const int64_t a = side * SIDE_VERTICES + i * (N + 1) + j;
        const int64_t square[4] = {a, a + N + 1, a + N + 2, a + 1};
        memcpy(corners + 4 * f, square, sizeof square);
      }
  for (int f = 0; f <= FACES; ++f) offsets[f] = 4 * f;
}

static bisector_mesh_arrays cube_arrays(void) {
  bisector_mesh_arrays arrays = BISECTOR_MESH_ARRAYS_INIT;
  arrays.vertices = vertices;
  arrays.vertex_count = VERTICES;
  arrays.faces = corners;
  arrays.face_offsets = offsets;
  arrays.face_count = FACES;
  return arrays;
}

static bisector_mesh* cube(void) {
  const bisector_mesh_arrays arrays = cube_arrays();
  bisector_mesh* mesh = NULL;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_OK);
  return mesh;
}

static bisector_options* options_for(const char* command, const char* n) {
  bisector_options* options = NULL;
  EXPECT(bisector_options_new(command, &options) == BISECTOR_OK);
  if (n) EXPECT(bisector_options_set(options, "n", n) == BISECTOR_OK);
  return options;
}

static void count_warning(void* user, const char* line) {
  EXPECT(strchr(line, '\n') == NULL);
  ++*(int*)user;
}

static void test_run(const char* folder) {
  bisector_mesh* mesh = cube();
  bisector_options* options = options_for("remesh", "100");
  bisector_callbacks callbacks = BISECTOR_CALLBACKS_INIT;
  bisector_result* result = NULL;
  bisector_array array;
  const char *report = NULL, *again = NULL;
  char path[4096];
  int warnings = 0;
  EXPECT(bisector_options_set(options, "energy", "ccvt") == BISECTOR_OK); /* vertices on the surface */
  callbacks.user = &warnings;
  callbacks.warning = count_warning;
  EXPECT(bisector_run(options, mesh, &callbacks, &result) == BISECTOR_OK);
  EXPECT(warnings >= 1); /* polygons were split */

  EXPECT(bisector_result_array(result, "vertices", &array) == BISECTOR_OK);
  EXPECT(array.type == BISECTOR_DOUBLE && array.columns == 3 && array.rows >= 100);
  const size_t count = array.rows;
  for (size_t i = 0; i < 3 * count; ++i) {
    const double x = ((const double*)array.data)[i];
    EXPECT(x > -1e-6 && x < 1 + 1e-6);
  }
  EXPECT(bisector_result_array(result, "faces", &array) == BISECTOR_OK);
  EXPECT(array.type == BISECTOR_UINT32 && array.columns == 3 && array.rows == 2 * count - 4); /* Euler */
  for (size_t i = 0; i < 3 * array.rows; ++i) EXPECT(((const uint32_t*)array.data)[i] < count);
  EXPECT(bisector_result_array(result, "labels", &array) == BISECTOR_OK);
  EXPECT(array.rows == 0 && array.data == NULL);
  EXPECT(bisector_result_array(result, "volumes", &array) == BISECTOR_FAILED && says("volumes"));

  EXPECT(bisector_result_report(result, NULL, &report) == BISECTOR_OK);
  EXPECT(strstr(report, "\"matches_input\": true") != NULL);
  EXPECT(bisector_result_report(result, NULL, &again) == BISECTOR_OK && again == report);

  snprintf(path, sizeof path, "%s/c_test.ply", folder);
  EXPECT(bisector_result_save(result, "output", path, NULL) == BISECTOR_OK);
  FILE* file = fopen(path, "rb");
  EXPECT(file != NULL);
  if (file) fclose(file);
  remove(path);
  EXPECT(bisector_result_save(result, "output", "out.xyz", NULL) == BISECTOR_FAILED && says(".ply"));
  EXPECT(bisector_result_save(result, "skeleton", path, NULL) == BISECTOR_USAGE && says("feature-output"));
  EXPECT(bisector_result_save(result, "output", "", NULL) == BISECTOR_FAILED);
  EXPECT(bisector_result_save(result, "report", "no/such/folder/report.html", NULL) == BISECTOR_FAILED);

  EXPECT(bisector_mesh_free(mesh) == BISECTOR_OK);
  EXPECT(bisector_options_free(options) == BISECTOR_OK);
  EXPECT(bisector_result_array(result, "vertices", &array) == BISECTOR_OK && array.rows == count);
  EXPECT(bisector_result_free(result) == BISECTOR_OK);
}

static void test_handles(void) {
  bisector_mesh* mesh = cube();
  bisector_options* options = options_for("rvd", "10");
  bisector_result* result = NULL;
  bisector_array array;
  int something = 0;
  EXPECT(bisector_run(NULL, mesh, NULL, &result) == BISECTOR_MISUSE && says("options"));
  EXPECT(bisector_run(options, NULL, NULL, &result) == BISECTOR_MISUSE && says("mesh"));
  EXPECT(bisector_run(options, (bisector_mesh*)options, NULL, &result) == BISECTOR_MISUSE && says("mesh"));
  EXPECT(bisector_run((bisector_options*)(void*)&something, mesh, NULL, &result) == BISECTOR_MISUSE);
  EXPECT(bisector_run(options, mesh, NULL, NULL) == BISECTOR_MISUSE);
  EXPECT(result == NULL);
  EXPECT(bisector_run(options, mesh, NULL, &result) == BISECTOR_OK);
  EXPECT(bisector_result_free(result) == BISECTOR_OK);
  EXPECT(bisector_result_free(result) == BISECTOR_MISUSE && says("freed"));
  EXPECT(bisector_result_array(result, "seeds", &array) == BISECTOR_MISUSE);
  EXPECT(bisector_mesh_free((bisector_mesh*)options) == BISECTOR_MISUSE);
  EXPECT(bisector_mesh_free(NULL) == BISECTOR_OK);
  EXPECT(bisector_mesh_free(mesh) == BISECTOR_OK);
  EXPECT(bisector_run(options, mesh, NULL, &result) == BISECTOR_MISUSE);
  EXPECT(bisector_options_free(options) == BISECTOR_OK);
  EXPECT(bisector_cancel_request(NULL) == BISECTOR_MISUSE);
}

static void test_arrays(void) {
  bisector_mesh* mesh = NULL;
  bisector_mesh_arrays arrays = cube_arrays();
  int64_t labels[2] = {1, 2};
  arrays.size = 0;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_MISUSE && says("size"));
  arrays.size = sizeof arrays + 8; /* of a newer header */
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_MISUSE && says("size"));
  arrays = cube_arrays();
  arrays.size = offsetof(bisector_mesh_arrays, tets); /* of an older header: what follows is not looked at */
  arrays.tet_count = 7;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_OK);
  EXPECT(bisector_mesh_free(mesh) == BISECTOR_OK);
  EXPECT(bisector_mesh_from_arrays(NULL, &mesh) == BISECTOR_MISUSE);
  arrays = cube_arrays();
  arrays.vertices = NULL;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_MISUSE);
  arrays = cube_arrays();
  arrays.labels = labels;
  arrays.label_count = 2;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_FAILED && says("2 labels"));
  arrays = cube_arrays();
  corners[5] = VERTICES;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_FAILED && says("face 1") && says("out of range"));
  corners[5] = -1;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_FAILED && says("-1"));
  make_cube();
  vertices[7] = NAN;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_FAILED && says("vertex 2") && says("finite"));
  make_cube();
  offsets[1] = 2;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_FAILED && says("fewer than three"));
  offsets[1] = -2;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_MISUSE);
  make_cube();
  EXPECT(bisector_mesh_from_file("", &mesh) == BISECTOR_FAILED);
}

static void test_attributes(void) {
  bisector_mesh* mesh = NULL;
  bisector_options* options = options_for("remesh", "100");
  bisector_result* result = NULL;
  bisector_mesh_arrays arrays = cube_arrays();
  bisector_attribute given[2] = {{"place", BISECTOR_VERTEX, BISECTOR_NUMBER_FLOAT64, 3, vertices, 3 * VERTICES},
                                 {"side", BISECTOR_ELEMENT, BISECTOR_NUMBER_INT32, 1, NULL, FACES}};
  bisector_attribute got;
  bisector_array points;
  double sides[FACES];
  size_t count = 0;
  for (int f = 0; f < FACES; ++f) sides[f] = f;
  given[1].values = sides;
  arrays.attributes = given;
  arrays.attribute_count = 2;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_OK);
  EXPECT(bisector_options_set(options, "energy", "ccvt") == BISECTOR_OK); /* vertices on the surface */
  EXPECT(bisector_run(options, mesh, NULL, &result) == BISECTOR_OK);
  EXPECT(bisector_result_attribute_count(result, &count) == BISECTOR_OK && count == 2);
  EXPECT(bisector_result_array(result, "vertices", &points) == BISECTOR_OK);
  EXPECT(bisector_result_attribute(result, 0, &got) == BISECTOR_OK);
  EXPECT(strcmp(got.name, "place") == 0 && got.site == BISECTOR_VERTEX && got.number == BISECTOR_NUMBER_FLOAT64);
  EXPECT(got.components == 3 && got.count == 3 * points.rows);
  for (size_t i = 0; i < got.count; ++i) EXPECT(fabs(got.values[i] - ((const double*)points.data)[i]) < 1e-9);
  EXPECT(bisector_result_attribute(result, 1, &got) == BISECTOR_OK && got.site == BISECTOR_ELEMENT);
  for (size_t i = 0; i < got.count; ++i) EXPECT(got.values[i] >= 0 && got.values[i] < FACES);
  EXPECT(bisector_result_attribute(result, 2, &got) == BISECTOR_FAILED && says("attribute 2"));
  EXPECT(bisector_result_attribute(NULL, 0, &got) == BISECTOR_MISUSE);
  EXPECT(bisector_result_attribute_count(result, NULL) == BISECTOR_MISUSE);
  EXPECT(bisector_result_free(result) == BISECTOR_OK);
  EXPECT(bisector_mesh_free(mesh) == BISECTOR_OK);
  EXPECT(bisector_options_free(options) == BISECTOR_OK);

  given[0].count = 5;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_FAILED && says("'place' has 5 values"));
  given[0].count = 3 * VERTICES;
  given[0].site = 7;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_MISUSE && says("bisector_site"));
  given[0].site = BISECTOR_VERTEX;
  given[1].number = -1;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_MISUSE && says("bisector_number"));
  given[1].name = NULL;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_MISUSE && says("no name"));
  arrays.attributes = NULL;
  EXPECT(bisector_mesh_from_arrays(&arrays, &mesh) == BISECTOR_MISUSE);
}

static void test_options(void) {
  bisector_mesh* mesh = cube();
  bisector_options* options = NULL;
  bisector_result* result = NULL;
  const char* json = NULL;
  EXPECT(bisector_options_new("bake", &options) == BISECTOR_USAGE && says("remesh"));
  options = options_for("remesh", "3");
  EXPECT(bisector_options_set(options, "size", "3") == BISECTOR_USAGE && says("edge-length"));
  EXPECT(bisector_options_set(options, "o", "x.off") == BISECTOR_USAGE);
  EXPECT(bisector_options_set(options, "help", NULL) == BISECTOR_USAGE);
  EXPECT(bisector_options_set(options, "report", "-") == BISECTOR_USAGE);
  EXPECT(bisector_options_set(options, "n", NULL) == BISECTOR_USAGE && says("missing"));
  EXPECT(bisector_options_set(options, "n", "") == BISECTOR_USAGE);
  EXPECT(bisector_run(options, mesh, NULL, &result) == BISECTOR_USAGE && says("whole number from 4"));
  EXPECT(bisector_options_set(options, "n", "--help") == BISECTOR_OK);
  EXPECT(bisector_run(options, mesh, NULL, &result) == BISECTOR_USAGE);
  EXPECT(bisector_options_set(options, "n", "50") == BISECTOR_OK);
  EXPECT(bisector_options_set(options, "fit", "perhaps") == BISECTOR_OK);
  EXPECT(bisector_run(options, mesh, NULL, &result) == BISECTOR_USAGE);
  EXPECT(bisector_options_set(options, "fit", "false") == BISECTOR_OK);
  EXPECT(bisector_options_set(options, "device", "vulkan:4000000") == BISECTOR_OK);
  EXPECT(bisector_run(options, mesh, NULL, &result) == BISECTOR_DEVICE);
  EXPECT(bisector_options_set(options, "device", "cpu") == BISECTOR_OK);
  EXPECT(bisector_options_density(options, vertices, 5) == BISECTOR_OK);
  EXPECT(bisector_run(options, mesh, NULL, &result) == BISECTOR_FAILED && says("5 values"));
  EXPECT(bisector_options_free(options) == BISECTOR_OK);
  options = options_for("segment", NULL);
  EXPECT(bisector_options_seeds(options, vertices, 2) == BISECTOR_OK);
  EXPECT(bisector_run(options, mesh, NULL, &result) == BISECTOR_USAGE && says("seeds"));
  EXPECT(bisector_options_free(options) == BISECTOR_OK);
  EXPECT(bisector_describe("tet", &json) == BISECTOR_OK && strstr(json, "\"min-dihedral\"") != NULL);
  EXPECT(bisector_devices(&json) == BISECTOR_OK && strstr(json, "\"cpu\"") != NULL);
  EXPECT(bisector_mesh_free(mesh) == BISECTOR_OK);
}

static void cancel_run(void* user, const bisector_progress* progress) {
  if (progress->iteration > 2) bisector_cancel_request((bisector_cancel*)user);
}

static void test_cancel(void) {
  bisector_mesh* mesh = cube();
  bisector_options* options = options_for("remesh", "3000");
  bisector_callbacks callbacks = BISECTOR_CALLBACKS_INIT;
  bisector_cancel* cancel = NULL;
  bisector_result* result = NULL;
  EXPECT(bisector_cancel_new(&cancel) == BISECTOR_OK);
  callbacks.user = cancel;
  callbacks.progress = cancel_run;
  callbacks.cancel = cancel;
  EXPECT(bisector_run(options, mesh, &callbacks, &result) == BISECTOR_CANCELLED && result == NULL);
  callbacks.size = 4;
  EXPECT(bisector_run(options, mesh, &callbacks, &result) == BISECTOR_MISUSE && says("callbacks"));
  EXPECT(bisector_cancel_free(cancel) == BISECTOR_OK);
  callbacks.size = sizeof callbacks;
  EXPECT(bisector_run(options, mesh, &callbacks, &result) == BISECTOR_MISUSE && says("cancel"));
  EXPECT(bisector_options_free(options) == BISECTOR_OK);
  EXPECT(bisector_mesh_free(mesh) == BISECTOR_OK);
}

int main(int argc, char** argv) {
  EXPECT(bisector_c_version() == BISECTOR_C_VERSION);
  EXPECT(strlen(bisector_version()) >= 5);
  make_cube();
  test_run(argc > 1 ? argv[1] : ".");
  test_handles();
  test_arrays();
  test_attributes();
  test_options();
  test_cancel();
  if (failures) fprintf(stderr, "c_test: %d failures\n", failures);
  return failures ? 1 : 0;
}
