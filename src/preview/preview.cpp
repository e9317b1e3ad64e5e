#include "bisector/preview.h"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "bisector/error.h"
#include "bisector/io.h"
#include "core/colour.h"
#include "core/geometry.h"
#include "core/grouping.h"
#include "core/parallel.h"
#include "io/files.h"

namespace bisector {
namespace {

constexpr int kSamples = 3;              // per pixel and axis
constexpr int kBandRows = 16;            // pixel rows that are drawn together
constexpr int kBandMargin = 2;           // sample rows that a band sees of its neighbours, for outlines
constexpr double kPictureMargin = 0.06;  // around the model, on each side, of the picture's size
constexpr double kCameraDistance = 4;    // in radii of the bounding sphere
constexpr double kCreaseCosine = 0.766;  // of 40 degrees between normals: sharper edges are not smoothed
constexpr std::size_t kLargestFan = 64;  // faces at a vertex that smoothing looks at
constexpr int kLargestPicture = 16384;   // pixels of width and height

// Edges are drawn half as wide as this, in pixels. They are at their darkest, as a part of pure ink, where the
// polygon's inner circle is at least as large as the last radius, in pixels, and fade to nothing at the first, where
// they would cover it.
constexpr double kHalfLine = 0.42;
constexpr double kEdgeInk = 0.78, kOutlineInk = 0.8;
constexpr double kNoEdgesRadius = 0.25, kFullEdgesRadius = 2;

// Weights of the light that comes from everywhere, from above, from the camera and from the key light, and of the key
// light's reflection, which is the sharper the higher the exponent.
constexpr double kAmbient = 0.14, kSky = 0.16, kHead = 0.32, kKey = 0.54, kGloss = 0.06, kGlossExponent = 40;

using Colour = std::array<unsigned char, 3>;
constexpr Colour kNeutral{188, 211, 236};                      // of polygons without a colour of their own
constexpr Colour kInk{34, 44, 66};                             // of edges and outlines
constexpr Colour kTop{250, 251, 252}, kBottom{226, 231, 238};  // of the background

// Light is added up linearly; files hold sRGB.
struct Rgb {
  float r = 0, g = 0, b = 0;

  Rgb& operator+=(const Rgb& o) {
    r += o.r;
    g += o.g;
    b += o.b;
    return *this;
  }
  friend Rgb operator*(float s, const Rgb& c) { return {s * c.r, s * c.g, s * c.b}; }
  friend Rgb operator*(const Rgb& a, const Rgb& b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }
  friend Rgb operator+(Rgb a, const Rgb& b) { return a += b; }
};

Rgb mix(const Rgb& a, const Rgb& b, float t) { return (1 - t) * a + t * b; }

Rgb to_linear(const Colour& c) {
  const auto light = [](unsigned char channel) { return static_cast<float>(light_of_srgb(channel)); };
  return {light(c[0]), light(c[1]), light(c[2])};
}

unsigned char to_srgb(float value) {
  const double x = std::clamp(static_cast<double>(value), 0.0, 1.0);
  const double s = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
  return static_cast<unsigned char>(std::lround(255 * s));
}

// A vertex as the camera sees it: x and y in samples, y down; `nearness` is linear on the screen and grows towards the
// camera.
struct Projected {
  double x, y, nearness;
};

struct Camera {
  Vec3 right, up, back;  // orthonormal; `back` points from the model to the camera
  std::vector<Projected> points;
};

Camera aim(const std::vector<Vec3>& vertices, const Csr<Index>& polygons, const PreviewOptions& options) {
  const double azimuth = options.azimuth * kRadiansPerDegree, elevation = options.elevation * kRadiansPerDegree;
  Camera camera;
  camera.right = {std::cos(azimuth), 0, -std::sin(azimuth)};
  camera.back = {std::sin(azimuth) * std::cos(elevation), std::sin(elevation), std::cos(azimuth) * std::cos(elevation)};
  camera.up = cross(camera.back, camera.right);

  std::vector<Vec3> used;
  for (const Index v : polygons.values) used.push_back(vertices[v]);
  const Box box = bounding_box(used);
  const Vec3 centre = 0.5 * box.lo + 0.5 * box.hi;
  const double radius = box.diagonal() > 0 ? box.diagonal() / 2 : 1;
  const auto project = [&](const Vec3& q) -> Projected {
    const Vec3 p = (1 / radius) * (q - centre);
    const double nearness = 1 / (kCameraDistance - dot(p, camera.back));
    return {dot(p, camera.right) * nearness, -dot(p, camera.up) * nearness, nearness};
  };

  double lo_x = 0, hi_x = 0, lo_y = 0, hi_y = 0;
  for (std::size_t k = 0; k < used.size(); ++k) {
    const Projected p = project(used[k]);
    lo_x = k ? std::min(lo_x, p.x) : p.x;
    hi_x = k ? std::max(hi_x, p.x) : p.x;
    lo_y = k ? std::min(lo_y, p.y) : p.y;
    hi_y = k ? std::max(hi_y, p.y) : p.y;
  }
  const double width = kSamples * options.width, height = kSamples * options.height;
  const double scale =
      (1 - 2 * kPictureMargin) * std::min(width / std::max(hi_x - lo_x, 1e-9), height / std::max(hi_y - lo_y, 1e-9));
  camera.points.resize(vertices.size());
  parallel_each(vertices.size(), [&](std::size_t v) {
    const Projected p = project(vertices[v]);
    camera.points[v] = {width / 2 + scale * (p.x - (lo_x + hi_x) / 2), height / 2 + scale * (p.y - (lo_y + hi_y) / 2),
                        p.nearness};
  });
  return camera;
}

// One normal per corner: the mean over the faces at the vertex that make no crease with this one, by area.
std::vector<Vec3> corner_normals(const std::vector<Vec3>& vertices, const Csr<Index>& polygons) {
  std::vector<Vec3> area(polygons.rows()), flat(polygons.rows());
  parallel_each(polygons.rows(), [&](std::size_t f) {
    const Index* corner = polygons.begin(f);
    for (std::size_t k = 2; k < polygons.size(f); ++k)
      area[f] += cross(vertices[corner[k - 1]] - vertices[corner[0]], vertices[corner[k]] - vertices[corner[0]]);
    flat[f] = unit(area[f]);
  });
  const Csr<Index> faces = group_into_rows<Index>(vertices.size(), [&](const auto& put) {  // of each vertex
    for (std::size_t f = 0; f < polygons.rows(); ++f)
      for (const Index* v = polygons.begin(f); v != polygons.end(f); ++v) put(*v, static_cast<Index>(f));
  });

  std::vector<Vec3> normals(polygons.values.size());
  parallel_each(polygons.rows(), [&](std::size_t f) {
    for (std::size_t k = polygons.offsets[f]; k < polygons.offsets[f + 1]; ++k) {
      const Index v = polygons.values[k];
      Vec3 sum = flat[f];
      if (faces.size(v) <= kLargestFan) {
        sum = {};
        for (const Index* g = faces.begin(v); g != faces.end(v); ++g)
          if (dot(flat[*g], flat[f]) > kCreaseCosine) sum += area[*g];
      }
      normals[k] = unit(sum);
    }
  });
  return normals;
}

// A headlight, a key light from the upper left of the camera and a sky that is brighter than the ground.
class Lights {
 public:
  explicit Lights(const Camera& camera)
      : back_(camera.back), key_(unit(camera.back + 0.9 * camera.up - 0.8 * camera.right)),
        half_(unit(key_ + camera.back)) {}

  // `n` need not be of unit length and may point away from the camera.
  Rgb shade(const Rgb& base, Vec3 n) const {
    n = unit(n);
    const bool behind = dot(n, back_) < 0;
    if (behind) n = -n;
    const double head = dot(n, back_), key = std::max(0.0, dot(n, key_));
    const double sky = 0.5 + 0.5 * n.y;
    const double gloss = std::pow(std::max(0.0, dot(n, half_)), kGlossExponent);
    const double light = kAmbient + kSky * sky + kHead * head + kKey * key;
    const Rgb paint = behind ? base * Rgb{0.75f, 0.55f, 0.45f} : base;
    return static_cast<float>(light) * paint + static_cast<float>(kGloss * gloss) * Rgb{1, 1, 1};
  }

 private:
  Vec3 back_, key_, half_;
};

struct Sample {
  float nearness = 0;  // 0: background
  Colour colour{};     // the polygon's, for outlines
  Rgb light;
};

// A triangle of a polygon's fan.
struct Piece {
  Index polygon, corner;  // corners 0, corner and corner + 1 of the polygon
};

struct Scene {
  const Csr<Index>& polygons;
  const PreviewOptions& options;
  Camera camera;
  std::vector<Vec3> normals;  // by corner
  std::vector<Piece> pieces;
  Lights lights;

  const Projected& point(std::size_t corner) const { return camera.points[polygons.values[corner]]; }
  Colour colour(std::size_t polygon) const { return options.colours.empty() ? kNeutral : options.colours[polygon]; }
};

// How dark a polygon's edges are drawn: fainter where it is so small on the screen that they would cover it.
double edge_strength(const Scene& scene, std::size_t polygon) {
  const std::size_t first = scene.polygons.offsets[polygon], last = scene.polygons.offsets[polygon + 1];
  double twice_area = 0, perimeter = 0;
  for (std::size_t k = first; k < last; ++k) {
    const Projected &a = scene.point(k), &b = scene.point(k + 1 < last ? k + 1 : first);
    twice_area += a.x * b.y - b.x * a.y;
    perimeter += std::sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y));
  }
  const double inradius = perimeter > 0 ? std::abs(twice_area) / perimeter : 0;
  return kEdgeInk * std::clamp((inradius / kSamples - kNoEdgesRadius) / (kFullEdgesRadius - kNoEdgesRadius), 0.0, 1.0);
}

// The rows [begin, end) of samples.
class Band {
 public:
  Band(const Scene& scene, int begin, int end)
      : scene_(scene), begin_(begin), end_(end), width_(kSamples * scene.options.width),
        samples_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(end - begin)) {}

  void draw(const Piece& piece);
  void draw_outlines();
  const Sample& at(int x, int y) const { return samples_[index(x, y)]; }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y - begin_) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  double edge_distance(std::size_t polygon, double x, double y) const;

  const Scene& scene_;
  int begin_, end_, width_;
  std::vector<Sample> samples_;
};

// From a point of a polygon to its border, in samples.
double Band::edge_distance(std::size_t polygon, double x, double y) const {
  const std::size_t first = scene_.polygons.offsets[polygon], last = scene_.polygons.offsets[polygon + 1];
  double least = 1e9;
  for (std::size_t k = first; k < last; ++k) {
    const Projected &a = scene_.point(k), &b = scene_.point(k + 1 < last ? k + 1 : first);
    const double dx = b.x - a.x, dy = b.y - a.y, length = std::sqrt(dx * dx + dy * dy);
    if (length > 0) least = std::min(least, std::abs(dx * (y - a.y) - dy * (x - a.x)) / length);
  }
  return least;
}

void Band::draw(const Piece& piece) {
  const std::size_t first = scene_.polygons.offsets[piece.polygon];
  const std::size_t corner[3] = {first, first + piece.corner, first + piece.corner + 1};
  const Projected &a = scene_.point(corner[0]), &b = scene_.point(corner[1]), &c = scene_.point(corner[2]);
  const double twice_area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  if (std::abs(twice_area) < 1e-12) return;
  const int lo_x = std::max(0, static_cast<int>(std::ceil(std::min({a.x, b.x, c.x}) - 0.5)));
  const int hi_x = std::min(width_ - 1, static_cast<int>(std::floor(std::max({a.x, b.x, c.x}) - 0.5)));
  const int lo_y = std::max(begin_, static_cast<int>(std::ceil(std::min({a.y, b.y, c.y}) - 0.5)));
  const int hi_y = std::min(end_ - 1, static_cast<int>(std::floor(std::max({a.y, b.y, c.y}) - 0.5)));
  if (lo_x > hi_x || lo_y > hi_y) return;

  const Colour colour = scene_.colour(piece.polygon);
  const Rgb paint = to_linear(colour), ink = to_linear(kInk);
  const double strength = scene_.options.edges ? edge_strength(scene_, piece.polygon) : 0;
  // Points a little outside, by this barycentric coordinate, count as inside, so that no crack shows between polygons.
  constexpr double kInside = -1e-7;
  for (int y = lo_y; y <= hi_y; ++y)
    for (int x = lo_x; x <= hi_x; ++x) {
      const double px = x + 0.5, py = y + 0.5;
      const double u = ((b.x - px) * (c.y - py) - (b.y - py) * (c.x - px)) / twice_area;
      const double v = ((c.x - px) * (a.y - py) - (c.y - py) * (a.x - px)) / twice_area;
      const double w = 1 - u - v;
      if (u < kInside || v < kInside || w < kInside) continue;
      const auto nearness = static_cast<float>(u * a.nearness + v * b.nearness + w * c.nearness);
      Sample& sample = samples_[index(x, y)];
      if (nearness <= sample.nearness) continue;
      sample.nearness = nearness;
      sample.colour = colour;
      sample.light = scene_.lights.shade(
          paint, u * scene_.normals[corner[0]] + v * scene_.normals[corner[1]] + w * scene_.normals[corner[2]]);
      if (strength > 0) {
        const double cover = std::clamp(kSamples * kHalfLine + 0.5 - edge_distance(piece.polygon, px, py), 0.0, 1.0);
        sample.light = mix(sample.light, ink, static_cast<float>(strength * cover));
      }
    }
}

void Band::draw_outlines() {
  std::vector<std::size_t> dark;
  const Rgb ink = to_linear(kInk);
  for (int y = begin_; y < end_; ++y)
    for (int x = 0; x < width_; ++x) {
      const Sample& sample = at(x, y);
      if (sample.nearness == 0) continue;
      bool border = false;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const int nx = std::clamp(x + dx, 0, width_ - 1), ny = std::clamp(y + dy, begin_, end_ - 1);
          const Sample& other = at(nx, ny);
          border = border || (other.nearness > 0 && other.colour != sample.colour);
        }
      if (border) dark.push_back(index(x, y));
    }
  for (const std::size_t k : dark) samples_[k].light = mix(samples_[k].light, ink, static_cast<float>(kOutlineInk));
}

// At a height of 0 (top) to 1.
Rgb background(double height) { return mix(to_linear(kTop), to_linear(kBottom), static_cast<float>(height)); }

// The pieces that touch each band of rows.
Csr<Index> sort_into_bands(const Scene& scene, std::size_t bands) {
  const auto range = [&](const Piece& piece) {
    const std::size_t first = scene.polygons.offsets[piece.polygon];
    const double a = scene.point(first).y, b = scene.point(first + piece.corner).y,
                 c = scene.point(first + piece.corner + 1).y;
    const double rows = kSamples * kBandRows;
    const auto band = [&](double y) {
      return static_cast<std::size_t>(std::clamp(std::floor(y / rows), 0.0, static_cast<double>(bands - 1)));
    };
    return std::pair(band(std::min({a, b, c}) - kBandMargin - 1), band(std::max({a, b, c}) + kBandMargin + 1));
  };
  return group_into_rows<Index>(bands, [&](const auto& put) {
    for (std::size_t k = 0; k < scene.pieces.size(); ++k)
      for (auto [band, last] = range(scene.pieces[k]); band <= last; ++band) put(band, static_cast<Index>(k));
  });
}

std::vector<Piece> split_into_pieces(const Csr<Index>& polygons) {
  std::vector<Piece> pieces;
  for (std::size_t f = 0; f < polygons.rows(); ++f)
    for (Index k = 1; k + 1 < polygons.size(f); ++k) pieces.push_back({static_cast<Index>(f), k});
  return pieces;
}

std::vector<unsigned char> render(const Scene& scene) {
  const int width = scene.options.width, height = scene.options.height;
  const auto columns = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(height);
  std::vector<unsigned char> pixels(3 * columns * rows);
  const auto bands = static_cast<std::size_t>((height + kBandRows - 1) / kBandRows);
  const Csr<Index> pieces = sort_into_bands(scene, bands);
  parallel_each(
      bands,
      [&](std::size_t b) {
        const int top = static_cast<int>(b) * kBandRows, bottom = std::min(height, top + kBandRows);
        Band band(scene, std::max(0, kSamples * top - kBandMargin),
                  std::min(kSamples * height, kSamples * bottom + kBandMargin));
        for (const Index* piece = pieces.begin(b); piece != pieces.end(b); ++piece) band.draw(scene.pieces[*piece]);
        if (scene.options.outlines) band.draw_outlines();
        for (int y = top; y < bottom; ++y) {
          const Rgb sky = background((y + 0.5) / height);
          for (int x = 0; x < width; ++x) {
            Rgb sum;
            for (int sy = 0; sy < kSamples; ++sy)
              for (int sx = 0; sx < kSamples; ++sx) {
                const Sample& sample = band.at(kSamples * x + sx, kSamples * y + sy);
                sum += sample.nearness > 0 ? sample.light : sky;
              }
            const Rgb mean = (1.0f / (kSamples * kSamples)) * sum;
            unsigned char* pixel = &pixels[3 * (static_cast<std::size_t>(y) * columns + static_cast<std::size_t>(x))];
            pixel[0] = to_srgb(mean.r);
            pixel[1] = to_srgb(mean.g);
            pixel[2] = to_srgb(mean.b);
          }
        }
      },
      1);
  return pixels;
}

std::string encode_png(const std::vector<unsigned char>& pixels, int width, int height) {
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels.data(), 0, nullptr))
    throw Error(std::string("the picture cannot be encoded: ") + image.message + "; ask for a smaller one");
  bytes.resize(size);
  return bytes;
}

}  // namespace

void write_preview(const std::string& path, const std::vector<Vec3>& vertices, const Csr<Index>& polygons,
                   const PreviewOptions& options) {
  if (options.width < 1 || options.height < 1 || options.width > kLargestPicture || options.height > kLargestPicture)
    throw Error(path + ": a picture is 1 to 16384 pixels wide and high; choose another size");
  const Camera camera = aim(vertices, polygons, options);
  const Scene scene{polygons,      options, camera, corner_normals(vertices, polygons), split_into_pieces(polygons),
                    Lights(camera)};
  write_file(path, encode_png(render(scene), options.width, options.height));
}

void write_preview(const std::string& path, const TriangleMesh& mesh, const PreviewOptions& options) {
  write_preview(path, mesh.vertices, rows_of(mesh.triangles), options);
}

}  // namespace bisector
