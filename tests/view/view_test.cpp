#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <vector>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "mesh/tet_topology.h"
#include "support/models.h"
#include "support/solids.h"
#include "view/page.h"
#include "view/payload.h"
#include "view/scene.h"
#include "view/simplify.h"

namespace bisector::view {
namespace {

using namespace test;

using Json = nlohmann::json;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// What a payload says, read anew by what payload.h states of its form.
class Decoded {
 public:
  explicit Decoded(const std::string& payload) {
    std::string bytes(1 << 24, '\0');
    uLongf size = bytes.size();
    EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(bytes.data()), &size, reinterpret_cast<const Bytef*>(payload.data()),
                         payload.size()),
              Z_OK);
    std::size_t length = 0;
    for (std::size_t k = 4; k-- > 0;) length = 256 * length + static_cast<unsigned char>(bytes[k]);
    header = Json::parse(bytes.substr(4, length));
    arrays_ = bytes.substr(4 + length, size - 4 - length);
  }

  std::vector<std::int64_t> integers(const Json& ref, std::size_t stride) const {
    std::vector<std::int64_t> values;
    std::size_t at = ref[0];
    while (values.size() < ref[1]) {
      std::int64_t code = 0;
      for (int shift = 0;; shift += 7) {
        const auto byte = static_cast<unsigned char>(arrays_.at(at++));
        code |= std::int64_t{byte & 127} << shift;
        if (byte < 128) break;
      }
      const std::int64_t before = values.size() < stride ? 0 : values[values.size() - stride];
      values.push_back(before + (code % 2 == 0 ? code / 2 : -(code + 1) / 2));
    }
    return values;
  }

  std::string text(const Json& ref) const { return arrays_.substr(ref[0], ref[1]); }

  std::vector<Vec3> vertices(std::size_t model) const {
    const auto grid = integers(header["models"][model]["vertices"], 3);
    std::vector<Vec3> points(grid.size() / 3);
    for (std::size_t i = 0; i < grid.size(); ++i)
      points[i / 3][static_cast<int>(i % 3)] =
          header["origin"][i % 3].get<double>() + header["step"].get<double>() * static_cast<double>(grid[i]);
    return points;
  }

  std::vector<std::int64_t> codes(std::size_t model, const char* key) const {
    return integers(header["models"][model]["values"][key]["codes"], 1);
  }

  Json header;

 private:
  std::string arrays_;
};

template <std::size_t N>
std::vector<std::int64_t> flat(const std::vector<std::array<Index, N>>& rows) {
  std::vector<std::int64_t> values;
  for (const auto& row : rows) values.insert(values.end(), row.begin(), row.end());
  return values;
}

Scene scene_of(const TriangleMesh& mesh) {
  Scene scene;
  scene.models = {surface_model("Result", "out.off", mesh)};
  measure_shapes(scene);
  return scene;
}

const Values& values_of(const Model& model, const std::string& key) {
  return *std::find_if(model.values.begin(), model.values.end(), [&](const Values& v) { return v.key == key; });
}

TEST(Payload, HoldsMeshAndReport) {
  TriangleMesh mesh = torus(24, 16);
  for (Vec3& p : mesh.vertices) p = 1e-3 * p + Vec3{1e4, -7, 0};
  mesh.feature_edges = {{0, 1}, {5, 4}};
  const std::string report = "{\"command\": \"remesh\", \"text\": \"\xc3\xa9 </script>\"}\n";
  const Decoded decoded(encode(scene_of(mesh), report));
  EXPECT_EQ(decoded.text(decoded.header["report"]), report);
  const Json& model = decoded.header["models"][0];
  EXPECT_EQ(decoded.integers(model["triangles"], 3), flat(mesh.triangles));
  EXPECT_EQ(decoded.integers(model["lines"], 2), flat(mesh.feature_edges));
  EXPECT_FALSE(model.contains("shown"));
  const std::vector<Vec3> vertices = decoded.vertices(0);
  ASSERT_EQ(vertices.size(), mesh.vertices.size());
  const double step = decoded.header["step"];
  const Box box = bounding_box(mesh.vertices);
  EXPECT_LT(step, 1e-5 * box.diagonal());
  for (std::size_t v = 0; v < vertices.size(); ++v)
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(vertices[v][k], mesh.vertices[v][k], 0.51 * step + 1e-11);
}

TEST(Payload, ValuesAreTheLibrarys) {
  const TriangleMesh mesh = wavy_patch(12);
  const QualityReport quality = measure_quality(mesh);
  const Scene scene = scene_of(mesh);
  const Values& theta = values_of(scene.models[0], "theta_min");
  EXPECT_EQ(*std::min_element(theta.at.begin(), theta.at.end()), quality.theta_min);
  const Values& q = values_of(scene.models[0], "q");
  EXPECT_EQ(*std::min_element(q.at.begin(), q.at.end()), quality.q_min);
  EXPECT_NEAR(std::accumulate(q.at.begin(), q.at.end(), 0.0) / static_cast<double>(q.at.size()), quality.q_ave, 1e-12);

  const Values& valence = values_of(scene.models[0], "valence");
  std::size_t interior = 0, regular = 0;
  for (const double x : valence.at) {
    interior += !std::isnan(x);
    regular += x == 6;
  }
  EXPECT_LT(interior, mesh.vertices.size());
  EXPECT_DOUBLE_EQ(static_cast<double>(regular) / static_cast<double>(interior), quality.valence6);
}

TEST(Payload, CodesAndCountsAgreeWithTheValues) {
  const TriangleMesh mesh = wavy_patch(12);
  const Scene scene = scene_of(mesh);
  const Decoded decoded(encode(scene, "{}"));
  const auto bin_steps = decoded.header["bin_steps"].get<std::int64_t>();
  for (const Measure& measure : scene.measures) {
    const Values& values = values_of(scene.models[0], measure.key);
    const auto codes = decoded.codes(0, measure.key.c_str());
    std::vector<std::size_t> counts(measure.bins, 0);
    ASSERT_EQ(codes.size(), values.at.size());
    for (std::size_t i = 0; i < codes.size(); ++i) {
      ASSERT_EQ(codes[i] == 0, std::isnan(values.at[i]));
      if (codes[i] == 0) continue;
      const double width = (measure.most - measure.least) / static_cast<double>(measure.bins);
      const double low = measure.least + width * static_cast<double>(codes[i] - 1) / static_cast<double>(bin_steps);
      EXPECT_GE(values.at[i], low - 1e-9);
      EXPECT_LE(values.at[i], low + width / static_cast<double>(bin_steps) + 1e-9);
      ++counts[static_cast<std::size_t>((codes[i] - 1) / bin_steps)];
    }
    EXPECT_EQ(decoded.header["models"][0]["values"][measure.key]["counts"], Json(counts)) << measure.key;
  }
}

TEST(Payload, WorstComeFirst) {
  const TriangleMesh mesh = wavy_patch(12);
  const Decoded decoded(encode(scene_of(mesh), "{}"));
  const Json& worst = decoded.header["models"][0]["values"]["q"]["worst"];
  ASSERT_EQ(worst.size(), 10u);
  EXPECT_EQ(worst[0]["value"], measure_quality(mesh).q_min);
  for (std::size_t k = 1; k < worst.size(); ++k) EXPECT_GE(worst[k]["value"], worst[k - 1]["value"]);
  for (const Json& element : worst) {
    const Triangle& t = mesh.triangles[element["number"].get<std::size_t>()];
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(element["corners"][k][0], mesh.vertices[t[k]].x);
  }
  const Measure valence{"valence", "", "", Element::vertex, Worst::off_six};
  EXPECT_EQ(worst_elements(valence, {6, kNan, 7, 3, 5}, 3), (std::vector<std::size_t>{3, 2, 4}));
}

TEST(Payload, FacesOfTheFileAreNamed) {
  TriangleMesh mesh = needles();
  mesh.face_of_triangle.assign(mesh.triangles.size(), 7);
  const Decoded decoded(encode(scene_of(mesh), "{}"));
  EXPECT_EQ(decoded.header["models"][0]["values"]["q"]["worst"][0]["number"], 7);
}

TEST(Payload, Tetrahedra) {
  const TetMesh mesh = five_tets();
  Scene scene;
  scene.models = {solid_model("Result", "", mesh, boundary_facets(mesh.tets))};
  measure_shapes(scene);
  const Decoded decoded(encode(scene, "{}"));
  EXPECT_EQ(decoded.integers(decoded.header["models"][0]["tets"], 4), flat(mesh.tets));
  const TetQualityReport quality = measure_tet_quality(mesh);
  const Json& values = decoded.header["models"][0]["values"];
  EXPECT_EQ(values["dihedral_min"]["worst"][0]["value"], quality.dihedral_min);
  EXPECT_EQ(values["radius_ratio"]["worst"][0]["value"], quality.radius_ratio_min);
  EXPECT_EQ(values["dihedral_min"]["worst"][0]["corners"].size(), 4u);
}

TEST(Payload, DistancesAreOfBothSides) {
  TriangleMesh inner = icosphere(2), outer = inner;
  for (Vec3& p : outer.vertices) p = 1.5 * p;
  Scene scene;
  scene.models = {surface_model("Input", "", inner), surface_model("Result", "", outer)};
  measure_distances(scene);
  const double percent = 100 / bounding_box(inner.vertices).diagonal();
  for (const double d : values_of(scene.models[1], "distance").at) EXPECT_NEAR(d, 0.5 * percent, 1e-9);
  for (const double d : values_of(scene.models[0], "distance").at) EXPECT_LE(d, 0.5 * percent + 1e-9);
  EXPECT_NEAR(scene.measures[0].most, 0.5 * percent, 1e-9);
}

TEST(Payload, GroupsAreNumberedByLabel) {
  Scene scene;
  scene.models = {surface_model("Input", "", single_triangle()), surface_model("Result", "", needles())};
  std::vector<std::int32_t> labels(needles().triangles.size(), 40);
  labels[1] = -3;
  add_labels(scene, {"label", "Face label", "", Element::triangle}, {{40}, labels});
  ASSERT_EQ(scene.measures.size(), 1u);
  const Decoded decoded(encode(scene, "{}"));
  EXPECT_EQ(decoded.header["measures"][0]["names"], Json({"-3", "40"}));
  EXPECT_EQ(decoded.codes(0, "label"), std::vector<std::int64_t>{2});
  EXPECT_EQ(decoded.codes(1, "label")[1], 1);
  EXPECT_EQ(decoded.header["models"][1]["values"]["label"]["counts"], Json({1, labels.size() - 1}));
}

TEST(Payload, NothingOrAlmostNothing) {
  EXPECT_EQ(Decoded(encode({}, "{}")).header["models"], Json::array());
  Scene scene;
  scene.models = {{"Scan", "", {{3, 4, 5}}}};
  const Vec3 point = Decoded(encode(scene, "{}")).vertices(0)[0];
  EXPECT_EQ(point, (Vec3{3, 4, 5}));
}

TEST(Simplify, HidesNoBadTriangle) {
  TriangleMesh mesh = icosphere(5);
  mesh.vertices[mesh.triangles[777][0]] = mesh.vertices[mesh.triangles[777][1]] + Vec3{1e-4, 0, 0};
  const Scene scene = scene_of(mesh);
  const Model& whole = scene.models[0];
  const Model less = simplified(whole, scene.measures, 2000);
  EXPECT_LE(less.triangles.size(), 2000u);
  EXPECT_GE(less.triangles.size(), 500u);
  for (const Triangle& t : less.triangles) EXPECT_TRUE(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
  for (const char* key : {"theta_min", "q"}) {
    const std::vector<double>&all = values_of(whole, key).at, &shown = values_of(less, key).at;
    ASSERT_EQ(shown.size(), less.triangles.size());
    EXPECT_EQ(*std::min_element(shown.begin(), shown.end()), *std::min_element(all.begin(), all.end())) << key;
  }
  // Its surface is near the sphere.
  EXPECT_LT(measure_distance({less.vertices, less.triangles}, mesh, 1000).max, 5);
}

TEST(Simplify, LargeModelsSayWhatIsShown) {
  const TriangleMesh mesh = icosphere(4);
  const Scene scene = scene_of(mesh);
  Limits limits;
  limits.triangles = 1000;
  const Decoded decoded(encode(scene, "{}", limits));
  const Json& model = decoded.header["models"][0];
  EXPECT_EQ(model["sizes"]["triangles"], mesh.triangles.size());
  EXPECT_LE(model["shown"]["triangles"], 1000);
  EXPECT_EQ(decoded.integers(model["triangles"], 3).size(), 3 * model["shown"]["triangles"].get<std::size_t>());
  // Histogram and list are of all.
  const auto counts = model["values"]["q"]["counts"].get<std::vector<std::size_t>>();
  EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), std::size_t{0}), mesh.triangles.size());
  EXPECT_EQ(model["values"]["q"]["worst"][0]["value"], measure_quality(mesh).q_min);
}

TEST(Simplify, PointsAreThinned) {
  Scene scene;
  scene.models = {{"Scan", "", random_seeds(icosphere(2), 1000, 1)}};
  Measure branch{"branch", "Branch", "", Element::triangle};
  branch.names = {"0", "1"};
  std::vector<double> values(1000, 1);
  values[0] = kNan;
  add_groups(scene, 0, branch, values);
  Limits limits;
  limits.points = 300;
  const Decoded decoded(encode(scene, "{}", limits));
  EXPECT_EQ(decoded.vertices(0).size(), 300u);
  EXPECT_EQ(decoded.codes(0, "branch").size(), 300u);
  EXPECT_EQ(decoded.codes(0, "branch")[0], 0);
  EXPECT_EQ(decoded.header["models"][0]["values"]["branch"]["counts"], Json({0, 999}));
}

TEST(Page, IsOneFileThatMayAskForNothing) {
  const std::string page = report_page("bisector remesh: <b>&.off", "{}", scene_of(icosphere(1)));
  EXPECT_NE(page.find("<title>bisector remesh: &lt;b&gt;&amp;.off</title>"), std::string::npos);
  EXPECT_NE(page.find("default-src 'none'; script-src 'sha256-"), std::string::npos);
  EXPECT_EQ(page.find("{{"), std::string::npos);
  EXPECT_EQ(page.find(" src="), std::string::npos);
  EXPECT_NE(page.find("Copyright"), std::string::npos);  // the licence of what is bundled
  const std::size_t data = page.find("id=\"data\">") + 10;
  const std::string base64 = page.substr(data, page.find('<', data) - data);
  EXPECT_EQ(base64.size() % 4, 0u);
  EXPECT_EQ(base64.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/="),
            std::string::npos);
}

}  // namespace
}  // namespace bisector::view
