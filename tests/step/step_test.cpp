// bisector-step from outside: what it writes is read back by OpenCASCADE.
#include <gtest/gtest.h>
#include <unistd.h>
#include <BRepCheck_Analyzer.hxx>
#include <BRepGProp.hxx>
#include <BRep_Tool.hxx>
#include <GProp_GProps.hxx>
#include <GeomAdaptor_Surface.hxx>
#include <IGESControl_Reader.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_PrinterOStream.hxx>
#include <STEPControl_Reader.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bisector/io.h"
#include "support/csg.h"
#include "support/models.h"

namespace bisector {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

struct Face {
  std::string type;
  double area = 0;
  bool valid = false;
};

std::string type_of_surface(const TopoDS_Face& face) {
  switch (GeomAdaptor_Surface(BRep_Tool::Surface(face)).GetType()) {
    case GeomAbs_Plane: return "plane";
    case GeomAbs_Cylinder: return "cylinder";
    case GeomAbs_Cone: return "cone";
    case GeomAbs_Sphere: return "sphere";
    case GeomAbs_Torus: return "torus";
    default: return "other";
  }
}

double area_of(const TopoDS_Shape& shape) {
  GProp_GProps properties;
  BRepGProp::SurfaceProperties(shape, properties);
  return properties.Mass();
}

std::vector<Face> faces_of(const TopoDS_Shape& shape) {
  std::vector<Face> faces;
  for (TopExp_Explorer at(shape, TopAbs_FACE); at.More(); at.Next()) {
    const TopoDS_Face face = TopoDS::Face(at.Current());
    faces.push_back({type_of_surface(face), area_of(face), static_cast<bool>(BRepCheck_Analyzer(face).IsValid())});
  }
  return faces;
}

class Step : public testing::Test {
 protected:
  Step() : folder_(fs::temp_directory_path() / ("bisector-step-test-" + std::to_string(::getpid()))) {
    fs::remove_all(folder_);
    fs::create_directory(folder_);
    Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_PrinterOStream));
  }
  ~Step() override { fs::remove_all(folder_); }

  std::string in(const std::string& name) const { return (folder_ / name).string(); }

  static int run(const std::string& command) { return std::system((command + " 2>&1").c_str()); }

  // The regions as JSON.
  Json segment(const TriangleMesh& mesh, const std::string& options) const {
    write_mesh(in("mesh.ply"), mesh);
    EXPECT_EQ(run(std::string(BISECTOR_PROGRAM) + " segment " + in("mesh.ply") + " -o " + in("regions.ply") +
                  " --quiet --json " + in("regions.json") + " " + options),
              0);
    std::ifstream file(in("regions.json"));
    return Json::parse(file);
  }

  int convert(const std::string& output, const std::string& options = "") const {
    return run(std::string(BISECTOR_STEP_PROGRAM) + " " + in("regions.json") + " -o " + in(output) + " " + options +
               " >" + in("said.txt"));
  }

  TopoDS_Shape read_step(const std::string& name) const {
    STEPControl_Reader reader;
    EXPECT_EQ(reader.ReadFile(in(name).c_str()), IFSelect_RetDone);
    reader.TransferRoots();
    return reader.OneShape();
  }

 private:
  fs::path folder_;
};

std::string type_in_step(const std::string& type) {
  for (const char* analytic : {"plane", "cylinder", "cone", "sphere", "torus"})
    if (type == analytic) return type;
  return "other";
}

struct Expected {
  std::string type;
  double area;
};

std::vector<Expected> regions_of(const Json& json) {
  std::vector<Expected> regions;
  for (const Json& region : json["regions"]) regions.push_back({type_in_step(region["type"]), region["area"]});
  return regions;
}

// Each region has a face of its type and area, whatever their order, and all together have the area of all regions.
void expect_faces(const std::vector<Expected>& regions, const std::vector<Face>& faces, double tolerance) {
  ASSERT_EQ(faces.size(), regions.size());
  std::map<std::string, std::vector<double>> expected, found;
  double area = 0, sum = 0;
  for (const Expected& region : regions) {
    expected[region.type].push_back(region.area);
    area += region.area;
  }
  for (const Face& face : faces) {
    found[face.type].push_back(face.area);
    sum += face.area;
  }
  EXPECT_NEAR(sum, area, 0.01 * area);
  for (auto& [type, areas] : expected) {
    std::sort(areas.begin(), areas.end());
    std::sort(found[type].begin(), found[type].end());
    ASSERT_EQ(found[type].size(), areas.size()) << type;
    for (std::size_t k = 0; k < areas.size(); ++k) EXPECT_NEAR(found[type][k], areas[k], tolerance * areas[k]) << type;
  }
}

TEST_F(Step, GeneratedPartsAreSolids) {
  for (const test::CsgModel& model : {test::csg_part(8000, 0, 1), test::turned_part(8000, 0, 1)}) {
    const Json json = segment(model.mesh, "--proxies " + std::to_string(model.primitives.size()));
    ASSERT_EQ(convert("part.step"), 0);
    const TopoDS_Shape shape = read_step("part.step");
    EXPECT_EQ(shape.ShapeType(), TopAbs_SOLID);
    EXPECT_TRUE(BRepCheck_Analyzer(shape).IsValid());
    const std::vector<Face> faces = faces_of(shape);
    for (const Face& face : faces) EXPECT_TRUE(face.valid) << face.type;
    // The true surfaces have areas that are known; those of the triangles in them are smaller.
    std::vector<Expected> exact;
    for (std::size_t k = 0; k < model.primitives.size(); ++k)
      exact.push_back({type_in_step(name_of(type_of(model.primitives[k]))), model.areas[k]});
    expect_faces(exact, faces, 0.01);
    double area = 0;
    for (const Face& face : faces) area += face.area;
    double of_regions = 0;
    for (const Expected& region : regions_of(json)) of_regions += region.area;
    EXPECT_NEAR(area, of_regions, 0.01 * of_regions);
    GProp_GProps properties;
    BRepGProp::VolumeProperties(shape, properties);
    const double volume = test::enclosed_volume(model.mesh);
    EXPECT_NEAR(properties.Mass(), volume, 0.01 * volume);
  }
}

TEST_F(Step, TheSameFileEachTime) {
  segment(test::csg_part(3000, 0, 1).mesh, "--proxies 13");
  const auto bytes = [&](const char* name) {
    EXPECT_EQ(convert(name), 0);
    std::ifstream file(in(name), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const std::string first = bytes("first.step");
  EXPECT_FALSE(first.empty());
  EXPECT_TRUE(bytes("second.step") == first);
}

TEST_F(Step, FandiskHasItsSurfaces) {
  const std::string path = test::shared_model("fandisk.off");
  if (path.empty()) GTEST_SKIP() << "no fandisk";
  const Json json = segment(read_mesh(path), "--proxies 22");
  ASSERT_EQ(convert("fandisk.step"), 0);
  const TopoDS_Shape shape = read_step("fandisk.step");
  EXPECT_EQ(shape.ShapeType(), TopAbs_SOLID);
  EXPECT_TRUE(BRepCheck_Analyzer(shape).IsValid());
  const std::vector<Face> faces = faces_of(shape);
  for (const Face& face : faces) EXPECT_TRUE(face.valid) << face.type;
  expect_faces(regions_of(json), faces, 0.05);
}

TEST_F(Step, WholeSurfacesAndIges) {
  const Json json = segment(test::icosphere(4), "--proxies 1");
  ASSERT_EQ(json["regions"][0]["type"], "sphere");
  ASSERT_EQ(convert("ball.step", "--unit m"), 0);
  const std::vector<Face> faces = faces_of(read_step("ball.step"));
  ASSERT_EQ(faces.size(), 1u);
  EXPECT_TRUE(faces[0].valid);
  const double of_region = json["regions"][0]["area"];
  EXPECT_NEAR(faces[0].area, 1e6 * of_region, 0.02e6 * of_region);  // it is read in millimetres
  ASSERT_EQ(convert("ball.step", "--unit in"), 0);
  EXPECT_NEAR(area_of(read_step("ball.step")), 25.4 * 25.4 * of_region, 0.02 * 25.4 * 25.4 * of_region);
  ASSERT_EQ(convert("ball.igs"), 0);
  IGESControl_Reader reader;
  EXPECT_EQ(reader.ReadFile(in("ball.igs").c_str()), IFSelect_RetDone);
  EXPECT_GT(reader.TransferRoots(), 0);
}

TEST_F(Step, BadInputIsAnError) {
  std::ofstream(in("regions.json")) << "{\"regions\": [{\"type\": \"plane\"}]}";
  EXPECT_NE(convert("out.step"), 0);
  EXPECT_FALSE(fs::exists(in("out.step")));
  segment(test::box(2), "--proxies 6");
  EXPECT_NE(convert("out.obj"), 0);
  EXPECT_NE(convert("missing/out.step"), 0);
}

}  // namespace
}  // namespace bisector
