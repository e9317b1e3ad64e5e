// LAS 1.0 to 1.4, not compressed (ASPRS, LAS Specification 1.4 R15, 2019).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "io/bytes.h"
#include "io/point_formats.h"
#include "io/text.h"

namespace bisector::io {

namespace {

constexpr std::size_t kHeaderSize = 227, kHeaderSize14 = 375;
constexpr std::array<std::size_t, 11> kRecordSizes{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};  // of the formats
constexpr std::uint8_t kCompressedBits = 0xC0;
constexpr std::uint8_t kLowNoise = 7, kHighNoise = 18;

struct Header {
  int minor = 0, format = 0;
  std::size_t size = 0, first_point = 0, record = 0, points = 0;
  std::size_t records = 0;  // variable length records after the header
  std::uint64_t first_extended = 0, extended = 0;
  bool wkt = false;
  Vec3 scale, offset;
};

template <class T>
T at(std::string_view bytes, std::size_t place) {
  return load<T>(bytes.data() + place, false);
}

void check_points(const std::string& path, const Header& h, std::uint64_t points, std::size_t size) {
  if (h.first_point < h.size || h.first_point > size)
    fail(path, fmt::format("byte 96: the points begin at byte {}, the header has {} and the file {}; {}", h.first_point,
                           h.size, size, kExportAgain));
  const auto format = static_cast<std::size_t>(h.format);
  if (h.record < kRecordSizes[format])
    fail(path, fmt::format("byte 105: point format {} needs {} bytes a point, the header tells {}; {}", h.format,
                           kRecordSizes[format], h.record, kExportAgain));
  const std::size_t room = (size - h.first_point) / h.record;
  if (points > room)
    fail(path, fmt::format("the header tells {}, the file has room for {}; it is truncated, {}",
                           quantity(points, "point", "points"), room, kExportAgain));
  if (points == 0) fail(path, "there is no point at all; export the file with points");
}

void read_scale(const std::string& path, std::string_view bytes, Header& h) {
  for (int k = 0; k < 3; ++k) {
    const auto axis = static_cast<std::size_t>(k);
    h.scale[k] = at<double>(bytes, 131 + 8 * axis);
    h.offset[k] = at<double>(bytes, 155 + 8 * axis);
    if (!std::isfinite(h.scale[k]) || h.scale[k] == 0 ||
        coordinate_flaw(std::abs(h.scale[k]) * 0x1p31 + std::abs(h.offset[k])))
      fail(path, fmt::format("byte {}: scale {} with offset {} gives no coordinates; {}", 131 + 8 * axis, h.scale[k],
                             h.offset[k], kExportAgain));
  }
}

Header read_header(const std::string& path, std::string_view bytes) {
  if (!bytes.starts_with("LASF")) fail(path, "does not begin with 'LASF'; check that this is a LAS file");
  if (bytes.size() < kHeaderSize)
    fail(path, fmt::format("the file ends in its header; it is truncated, {}", kExportAgain));
  Header h;
  const int major = at<std::uint8_t>(bytes, 24);
  h.minor = at<std::uint8_t>(bytes, 25);
  if (major != 1 || h.minor > 4)
    fail(path, fmt::format("LAS {}.{} cannot be read; export as LAS 1.0 to 1.4", major, h.minor));
  const auto format = at<std::uint8_t>(bytes, 104);
  if (format & kCompressedBits)
    fail(path, "the points are compressed (LAZ); decompress the file first, e.g. with laszip -i IN.laz -o OUT.las");
  h.format = format;
  if (format >= kRecordSizes.size())
    fail(path, fmt::format("byte 104: point format {} is unknown; export with one of 0 to 10", h.format));
  h.size = at<std::uint16_t>(bytes, 94);
  if (const std::size_t least = h.minor < 4 ? kHeaderSize : kHeaderSize14; h.size < least || bytes.size() < least)
    fail(path,
         fmt::format("byte 94: the header of LAS 1.{} has {} bytes at least, this one tells {} in a file of {}; {}",
                     h.minor, least, h.size, bytes.size(), kExportAgain));
  h.first_point = at<std::uint32_t>(bytes, 96);
  h.records = at<std::uint32_t>(bytes, 100);
  h.record = at<std::uint16_t>(bytes, 105);
  h.wkt = h.minor == 4 && (at<std::uint16_t>(bytes, 6) & 0x10);
  std::uint64_t points = at<std::uint32_t>(bytes, 107);
  if (h.minor == 4) {
    h.first_extended = at<std::uint64_t>(bytes, 235);
    h.extended = at<std::uint32_t>(bytes, 243);
    if (const auto all = at<std::uint64_t>(bytes, 247); all > 0) points = all;
  }
  check_points(path, h, points, bytes.size());
  h.points = static_cast<std::size_t>(points);
  read_scale(path, bytes, h);
  return h;
}

// --- units ---

// What the variable length records say of the coordinate system.
struct System {
  std::string_view geo_keys, geo_doubles, wkt;
};

void take_record(std::string_view head, std::string_view body, System& system) {
  if (!head.substr(2, 16).starts_with("LASF_Projection")) return;
  switch (at<std::uint16_t>(head, 18)) {
    case 34735: system.geo_keys = body; break;
    case 34736: system.geo_doubles = body; break;
    case 2112: system.wkt = body; break;
    default: break;
  }
}

// The records from byte `from` up to `end`, with lengths of the type Length; false if they are damaged.
template <class Length>
bool take_records(std::string_view bytes, std::uint64_t from, std::uint64_t count, System& system) {
  constexpr std::size_t kHead = 20 + sizeof(Length) + 32;
  for (std::uint64_t k = 0; k < count; ++k) {
    if (from > bytes.size() || bytes.size() - from < kHead) return false;
    const std::string_view head = bytes.substr(static_cast<std::size_t>(from), kHead);
    const auto length = at<Length>(head, 20);
    from += kHead;
    if (length > bytes.size() - from) return false;
    take_record(head, bytes.substr(static_cast<std::size_t>(from), static_cast<std::size_t>(length)), system);
    from += length;
  }
  return true;
}

SystemUnits read_units(const std::string& path, std::string_view bytes, const Header& h, const Context& context) {
  System system;
  const bool sound = take_records<std::uint16_t>(bytes.substr(0, h.first_point), h.size, h.records, system) &&
                     take_records<std::uint64_t>(bytes, h.first_extended, h.extended, system);
  if (!sound)
    context.warn(fmt::format("{}: the variable length records are damaged; what they say is left out", name_of(path)));
  const bool by_wkt = !system.wkt.empty() && (h.wkt || system.geo_keys.empty());
  return by_wkt ? units_of_wkt(system.wkt) : units_of_geo_keys(system.geo_keys, system.geo_doubles);
}

void apply_units(const std::string& path, const SystemUnits& units, PointCloud& cloud, const Context& context) {
  constexpr double kEqual = 1e-5;  // survey feet are 2e-6 longer than feet
  if (units.degrees) fail(path, "x and y are in degrees; project the points first, e.g. to UTM");
  cloud.unit = units.horizontal;
  if (units.horizontal == 0 || units.vertical == 0) return;
  const double ratio = units.vertical / units.horizontal;
  if (std::abs(ratio - 1) < kEqual) return;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    double& z = cloud.points[i].z;
    z *= ratio;
    if (const char* flaw = coordinate_flaw(z)) fail(path, fmt::format("point {}: {}", i, flaw));
  }
  context.warn(fmt::format("{}: z is in units of {:.6g} m, x and y of {:.6g} m; z was converted to theirs",
                           name_of(path), units.vertical, units.horizontal));
}

// --- points ---

// Where a point's record has its class and the flag that withholds it, by the format.
struct ClassPlace {
  std::size_t classes, flags;
  std::uint8_t class_bits, withheld;
};
constexpr ClassPlace kClass{15, 15, 0x1F, 0x80}, kClass14{16, 15, 0xFF, 0x04};

void read_records(std::string_view bytes, const Header& h, PointCloud& cloud, std::size_t& noise,
                  std::size_t& withheld) {
  const bool classified = h.minor > 0;  // LAS 1.0 leaves classes to whoever wrote the file
  const ClassPlace& place = h.format < 6 ? kClass : kClass14;
  cloud.points.reserve(h.points);
  if (classified) cloud.classification.reserve(h.points);
  const char* record = bytes.data() + h.first_point;
  for (std::size_t i = 0; i < h.points; ++i, record += h.record) {
    if (classified) {
      const auto kind = static_cast<std::uint8_t>(load<std::uint8_t>(record + place.classes, false) & place.class_bits);
      if (load<std::uint8_t>(record + place.flags, false) & place.withheld) {
        ++withheld;
        continue;
      }
      if (kind == kLowNoise || kind == kHighNoise) {
        ++noise;
        continue;
      }
      cloud.classification.push_back(kind);
    }
    Vec3 p;
    for (int k = 0; k < 3; ++k) p[k] = h.scale[k] * load<std::int32_t>(record + 4 * k, false) + h.offset[k];
    cloud.points.push_back(p);
  }
}

}  // namespace

PointCloud read_las(const std::string& path, std::string_view bytes, const Context& context) {
  const Header h = read_header(path, bytes);
  const SystemUnits units = read_units(path, bytes, h, context);
  PointCloud cloud;
  std::size_t noise = 0, withheld = 0;
  read_records(bytes, h, cloud, noise, withheld);
  if (cloud.points.empty())
    fail(path, fmt::format("all {} are classified as noise or withheld; classify them anew",
                           quantity(h.points, "point", "points")));
  if (noise > 0)
    context.warn(fmt::format("{}: {} classified as noise left out", name_of(path), quantity(noise, "point", "points")));
  if (withheld > 0)
    context.warn(
        fmt::format("{}: {} flagged as withheld left out", name_of(path), quantity(withheld, "point", "points")));
  apply_units(path, units, cloud, context);
  return cloud;
}

}  // namespace bisector::io
