#include "bisector/preview.h"

#include <gtest/gtest.h>
#include <png.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "bisector/error.h"
#include "core/parallel.h"
#include "support/models.h"

namespace bisector {
namespace {

struct Picture {
  int width = 0, height = 0;
  std::vector<unsigned char> pixels;

  int brightness(int x, int y) const {
    const std::size_t k = 3 * static_cast<std::size_t>(y * width + x);
    return pixels[k] + pixels[k + 1] + pixels[k + 2];
  }
};

class PreviewTest : public testing::Test {
 protected:
  PreviewTest() {
    std::string name = (std::filesystem::temp_directory_path() / "bisector-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~PreviewTest() override { std::filesystem::remove_all(folder_); }

  std::string path(const char* name) const { return (folder_ / name).string(); }

  std::string bytes(const TriangleMesh& mesh, const PreviewOptions& options = {}) const {
    write_preview(path("a.png"), mesh, options);
    std::ifstream in(path("a.png"), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  Picture draw(const TriangleMesh& mesh, const PreviewOptions& options = {}) const {
    const std::string file = bytes(mesh, options);
    png_image image;
    std::memset(&image, 0, sizeof image);
    image.version = PNG_IMAGE_VERSION;
    EXPECT_TRUE(png_image_begin_read_from_memory(&image, file.data(), file.size()));
    image.format = PNG_FORMAT_RGB;
    Picture picture{static_cast<int>(image.width), static_cast<int>(image.height), {}};
    picture.pixels.resize(PNG_IMAGE_SIZE(image));
    EXPECT_TRUE(png_image_finish_read(&image, nullptr, picture.pixels.data(), 0, nullptr));
    return picture;
  }

  std::filesystem::path folder_;
};

PreviewOptions small(bool edges = true) {
  PreviewOptions options;
  options.width = 160;
  options.height = 120;
  options.edges = edges;
  return options;
}

double mean_brightness(const Picture& picture) {
  double sum = 0;
  for (const unsigned char c : picture.pixels) sum += c;
  return sum / static_cast<double>(picture.pixels.size());
}

TEST_F(PreviewTest, FitsTheModelIntoTheFrame) {
  for (const double scale : {1.0, 1e-60, 1e90}) {
    TriangleMesh mesh = test::icosphere(3);
    for (Vec3& v : mesh.vertices) v = scale * (v + Vec3{7, -3, 2});
    const Picture picture = draw(mesh, small());
    ASSERT_EQ(picture.width, 160);
    ASSERT_EQ(picture.height, 120);
    int top = 120, bottom = 0;
    for (int y = 0; y < 120; ++y)
      if (picture.brightness(80, y) < picture.brightness(0, y) - 30) {
        top = std::min(top, y);
        bottom = y;
      }
    EXPECT_GT(top, 2) << scale;
    EXPECT_LT(top, 20) << scale;
    EXPECT_GT(bottom, 100) << scale;
    EXPECT_LT(bottom, 118) << scale;
    for (const int x : {0, 159})
      for (const int y : {0, 119}) EXPECT_GT(picture.brightness(x, y), 600) << scale;
  }
}

TEST_F(PreviewTest, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh mesh = test::torus(40, 20);
  std::string one, many;
  {
    const ThreadLimit limit(1);
    one = bytes(mesh, small());
  }
  {
    const ThreadLimit limit(4);
    many = bytes(mesh, small());
  }
  EXPECT_EQ(one, many);
}

TEST_F(PreviewTest, EdgesDarken) {
  const TriangleMesh mesh = test::icosphere(2);
  EXPECT_LT(mean_brightness(draw(mesh, small(true))), mean_brightness(draw(mesh, small(false))) - 1);
}

TEST_F(PreviewTest, OutlinesAppearBetweenColoursOnly) {
  const TriangleMesh mesh = test::icosphere(2);
  PreviewOptions options = small(false);
  options.colours.assign(mesh.triangles.size(), {200, 180, 160});
  const std::string plain = bytes(mesh, options);
  options.outlines = true;
  EXPECT_EQ(bytes(mesh, options), plain);
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 2) options.colours[t] = {200, 180, 162};
  EXPECT_NE(bytes(mesh, options), plain);
}

TEST_F(PreviewTest, NearerSurfacesHideFartherOnes) {
  TriangleMesh mesh = test::icosphere(3);
  const Picture alone = draw(mesh, small());
  const auto shift = static_cast<Index>(mesh.vertices.size());
  const TriangleMesh inner = test::icosphere(2);
  for (const Vec3& v : inner.vertices) mesh.vertices.push_back(0.5 * v);
  for (const Triangle& t : inner.triangles) mesh.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  EXPECT_EQ(draw(mesh, small()).pixels, alone.pixels);
}

TEST_F(PreviewTest, DrawsAnything) {
  EXPECT_NO_THROW(draw({}, small()));
  EXPECT_NO_THROW(draw(test::needles(), small()));
  EXPECT_NO_THROW(draw(test::collinear_among_good(), small()));
  EXPECT_NO_THROW(draw(test::soup(50, 1), small()));
  TriangleMesh point;
  point.vertices = {{1, 2, 3}};
  point.triangles = {{0, 0, 0}};
  EXPECT_NO_THROW(draw(point, small()));
}

TEST_F(PreviewTest, RefusesWhatCannotBeWritten) {
  PreviewOptions options = small();
  options.width = 0;
  EXPECT_THROW(write_preview(path("b.png"), test::icosphere(0), options), Error);
  EXPECT_THROW(write_preview(path("missing/b.png"), test::icosphere(0), small()), Error);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

}  // namespace
}  // namespace bisector
