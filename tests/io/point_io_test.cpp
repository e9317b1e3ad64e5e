// Scans: files made here byte by byte read as what they hold, and what is malformed is refused in one line.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "core/geometry.h"
#include "core/random.h"
#include "io/bytes.h"
#include "io/point_formats.h"
#include "support/allocations.h"
#include "support/files.h"

namespace bisector::test {
namespace {

using io::append_bytes;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class PointIo : public FileTest {
 protected:
  PointCloud read(const std::string& name, std::string_view bytes) {
    return read_point_cloud(store(name, bytes), collecting());
  }
  // Refused in one line that begins with the file's name and `place`, has `what` in it and says what to do.
  void expect_refused(const std::string& name, std::string_view bytes, const std::string& place,
                      const std::string& what) {
    const std::string path = store(name, bytes);
    largest_allocation = 0;
    try {
      read_point_cloud(path);
      ADD_FAILURE() << what << " was not refused";
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.rfind(path + place, 0), 0u) << message;
      EXPECT_NE(message.find(what), std::string::npos) << message << " lacks " << what;
      EXPECT_NE(message.find("; "), std::string::npos) << "says what to do: " << message;
      for (const char c : message) EXPECT_GE(static_cast<unsigned char>(c), 0x20) << message;
    }
    EXPECT_LE(largest_allocation, std::size_t{1} << 18) << what;
  }
};

template <class T>
void put(std::string& bytes, std::size_t at, T value) {
  std::string word;
  append_bytes(word, value);
  bytes.replace(at, word.size(), word);
}

using Reader = std::function<PointCloud(std::string_view)>;

// Every prefix and 3000 files with a few other bytes are read or refused, and nothing worse.
void expect_sturdy(const Reader& read, const std::string& bytes) {
  std::size_t refused = 0;
  const auto check = [&](const std::string& damaged) {
    largest_allocation = 0;
    try {
      for (const Vec3& p : read(damaged).points)
        for (int k = 0; k < 3; ++k) ASSERT_LE(std::abs(p[k]), 1e100);
    } catch (const Error&) {
      ++refused;
    }
    EXPECT_LE(largest_allocation, std::size_t{1} << 18);
  };
  for (std::size_t n = 0; n < bytes.size(); ++n) check(bytes.substr(0, n));
  EXPECT_GT(refused, bytes.size() / 2);
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    Random random(7, seed);
    std::string damaged = bytes;
    for (int k = 0; k < 3; ++k)
      damaged[static_cast<std::size_t>(random.uniform() * static_cast<double>(bytes.size()))] =
          random.uniform() < 0.3 ? '\xff' : static_cast<char>(256 * random.uniform());
    check(damaged);
  }
}

// ---- LAS

constexpr std::array<std::size_t, 11> kRecordSizes{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};

struct LasPoint {
  std::array<std::int32_t, 3> xyz{};
  std::uint8_t kind = 0;
  bool withheld = false;
};

struct LasRecord {
  std::uint16_t id = 0;
  std::string body;
};

struct LasFile {
  int minor = 2, format = 0;
  std::size_t extra = 0;  // bytes of a record beyond its format's
  Vec3 scale{0.001, 0.01, 0.5}, offset{100, -20, 3};
  std::vector<LasPoint> points;
  std::vector<LasRecord> records, extended;
  bool wkt = false, legacy_count = true;

  Vec3 position(const LasPoint& p) const {
    Vec3 v;
    for (int k = 0; k < 3; ++k) v[k] = p.xyz[static_cast<std::size_t>(k)] * scale[k] + offset[k];
    return v;
  }

  std::string bytes() const {
    const std::size_t header = minor < 3 ? 227 : minor == 3 ? 235 : 375;
    std::string out(header, '\0');
    out.replace(0, 4, "LASF");
    put(out, 6, static_cast<std::uint16_t>(wkt ? 0x10 : 0));
    out[24] = 1;
    out[25] = static_cast<char>(minor);
    put(out, 94, static_cast<std::uint16_t>(header));
    put(out, 100, static_cast<std::uint32_t>(records.size()));
    out[104] = static_cast<char>(format);
    const std::size_t record = kRecordSizes[static_cast<std::size_t>(format)] + extra;
    put(out, 105, static_cast<std::uint16_t>(record));
    if (legacy_count) put(out, 107, static_cast<std::uint32_t>(points.size()));
    for (int k = 0; k < 3; ++k) {
      put(out, 131 + 8 * static_cast<std::size_t>(k), scale[k]);
      put(out, 155 + 8 * static_cast<std::size_t>(k), offset[k]);
    }
    for (const LasRecord& r : records) out += head(r, false) + r.body;
    put(out, 96, static_cast<std::uint32_t>(out.size()));
    for (const LasPoint& p : points) {
      std::string bytes(record, '\x55');
      for (std::size_t k = 0; k < 3; ++k) put(bytes, 4 * k, p.xyz[k]);
      bytes[format < 6 ? 15 : 16] = static_cast<char>(format < 6 ? p.kind | (p.withheld ? 0xA0 : 0x60) : p.kind);
      if (format >= 6) bytes[15] = p.withheld ? '\x0F' : '\x3B';
      out += bytes;
    }
    if (minor == 4) {
      put(out, 235, static_cast<std::uint64_t>(out.size()));
      put(out, 243, static_cast<std::uint32_t>(extended.size()));
      put(out, 247, static_cast<std::uint64_t>(points.size()));
      for (const LasRecord& r : extended) out += head(r, true) + r.body;
    }
    return out;
  }

 private:
  static std::string head(const LasRecord& r, bool extended) {
    std::string out(extended ? 60 : 54, '\0');
    out.replace(2, 15, "LASF_Projection");
    put(out, 18, r.id);
    if (extended) put(out, 20, static_cast<std::uint64_t>(r.body.size()));
    else put(out, 20, static_cast<std::uint16_t>(r.body.size()));
    return out;
  }
};

LasFile some_las() {
  LasFile file;
  constexpr auto kLeast = std::numeric_limits<std::int32_t>::min(), kMost = std::numeric_limits<std::int32_t>::max();
  file.points = {{{1, 2, 3}, 2}, {{-5, 0, 700}, 5}, {{kLeast, kMost, -1}, 0}, {{8, 8, 8}, 31}, {{0, 1, 0}, 6}};
  return file;
}

std::string geo_keys(const std::vector<std::array<std::uint16_t, 4>>& keys) {
  std::string out;
  for (const std::uint16_t n : {std::uint16_t{1}, std::uint16_t{1}, std::uint16_t{0}}) append_bytes(out, n);
  append_bytes(out, static_cast<std::uint16_t>(keys.size()));
  for (const auto& key : keys)
    for (const std::uint16_t n : key) append_bytes(out, n);
  return out;
}

TEST_F(PointIo, ReadsLasOfEveryFormat) {
  for (const auto& [minor, formats] : {std::pair{0, 2}, {1, 2}, {2, 4}, {3, 6}, {4, 11}})
    for (int format = 0; format < formats; ++format)
      for (const std::size_t extra : {0u, 7u}) {
        LasFile file = some_las();
        file.minor = minor;
        file.format = format;
        file.extra = extra;
        file.legacy_count = minor < 4 || format < 6;
        std::vector<Vec3> points;
        std::vector<std::uint8_t> kinds;
        for (const LasPoint& p : file.points) {
          points.push_back(file.position(p));
          if (minor > 0) kinds.push_back(p.kind);
        }
        const PointCloud cloud = read("a.las", file.bytes());
        EXPECT_EQ(cloud.points, points) << minor << ' ' << format;
        EXPECT_EQ(cloud.classification, kinds) << minor << ' ' << format;
        EXPECT_EQ(cloud.unit, 0);
        EXPECT_TRUE(warnings_.empty());
      }
}

TEST_F(PointIo, LeavesOutNoiseAndWithheldPoints) {
  for (const int format : {0, 3, 6, 10}) {
    LasFile file = some_las();
    file.minor = 4;
    file.format = format;
    const std::vector<Vec3> kept = read("a.las", file.bytes()).points;
    file.points.insert(file.points.begin() + 1, {{9, 9, 9}, 7});
    file.points.insert(file.points.begin() + 3, {{9, 9, 9}, 18});
    file.points.push_back({{9, 9, 9}, 2, true});
    const PointCloud cloud = read("a.las", file.bytes());
    EXPECT_EQ(cloud.points, kept) << format;
    EXPECT_EQ(cloud.classification.size(), kept.size());
    ASSERT_EQ(warnings_.size(), 2u);
    EXPECT_NE(warnings_[0].find("2 points classified as noise"), std::string::npos) << warnings_[0];
    EXPECT_NE(warnings_[1].find("1 point flagged as withheld"), std::string::npos) << warnings_[1];
    file.points = {{{1, 1, 1}, 7}, {{1, 2, 1}, 2, true}};
    expect_refused("a.las", file.bytes(), ": ", "all 2 points are classified as noise or withheld");
  }
}

TEST_F(PointIo, LasCoordinatesAreExactFarFromTheOrigin) {
  LasFile file;
  file.scale = {1e-4, 1e-4, 1e-4};
  file.offset = {500'000, 5'400'000, 0};
  for (std::int32_t i = 0; i < 1000; ++i) file.points.push_back({{i, -i, 2'000'000'000 + i}});
  const std::vector<Vec3> points = read("a.las", file.bytes()).points;
  ASSERT_EQ(points.size(), 1000u);
  for (std::size_t i = 0; i + 1 < points.size(); ++i)
    EXPECT_LE(norm(points[i + 1] - points[i] - Vec3{1e-4, -1e-4, 1e-4}), 4e-9);
}

TEST_F(PointIo, LasCountsAreThoseOfTheFile) {
  LasFile file = some_las();
  file.minor = 4;
  file.legacy_count = false;
  const std::string bytes = file.bytes();
  EXPECT_EQ(read("a.las", bytes).points.size(), 5u);
  for (const std::uint64_t count :
       {std::uint64_t{6}, std::uint64_t{1} << 32, std::uint64_t{1} << 63, ~std::uint64_t{0}}) {
    std::string more = bytes;
    put(more, 247, count);
    expect_refused("a.las", more, ": ", "the file has room for 5");
  }
  std::string none = bytes;
  put(none, 247, std::uint64_t{0});
  expect_refused("a.las", none, ": ", "no point at all");
  put(none, 107, std::uint32_t{3});
  EXPECT_EQ(read("a.las", none).points.size(), 3u);
  std::string old = some_las().bytes();
  put(old, 107, std::uint32_t{0xFFFFFFFF});
  expect_refused("a.las", old, ": the header tells 4294967295 points", "the file has room for 5");
}

TEST_F(PointIo, RefusesMalformedLas) {
  const std::string good = some_las().bytes();
  const auto refuse = [&](const std::function<void(std::string&)>& change, const char* place, const char* what) {
    std::string bytes = good;
    change(bytes);
    expect_refused("a.las", bytes, place, what);
  };
  refuse([](std::string& b) { b[3] = 'G'; }, ": ", "'LASF'");
  refuse([](std::string& b) { b.resize(200); }, ": ", "truncated");
  refuse([](std::string& b) { b.resize(b.size() - 1); }, ": ", "room for 4");
  refuse([](std::string& b) { b[24] = 2; }, ": LAS 2.2", "1.0 to 1.4");
  refuse([](std::string& b) { b[25] = 5; }, ": LAS 1.5", "1.0 to 1.4");
  refuse([](std::string& b) { b[104] = 11; }, ": byte 104", "format 11");
  refuse([](std::string& b) { b[104] = '\x80'; }, ": ", "laszip");
  refuse([](std::string& b) { b[104] = '\x43'; }, ": ", "laszip");
  refuse([](std::string& b) { put(b, 94, std::uint16_t{226}); }, ": byte 94", "227 bytes at least");
  refuse([](std::string& b) { b[25] = 4; }, ": byte 94", "375 bytes at least");
  refuse([](std::string& b) { put(b, 96, std::uint32_t{100}); }, ": byte 96", "begin at byte 100");
  refuse([](std::string& b) { put(b, 96, std::uint32_t{0xFFFFFFF0}); }, ": byte 96", "begin at byte 4294967280");
  refuse([](std::string& b) { put(b, 105, std::uint16_t{19}); }, ": byte 105", "needs 20 bytes");
  refuse([](std::string& b) { put(b, 105, std::uint16_t{0}); }, ": byte 105", "needs 20 bytes");
  for (const double scale : {0.0, kNan, 1e300, std::numeric_limits<double>::infinity()})
    refuse([&](std::string& b) { put(b, 139, scale); }, ": byte 139", "no coordinates");
  refuse([](std::string& b) { put(b, 155, kNan); }, ": byte 131", "no coordinates");

  std::string packed = good;
  packed[104] = '\x80';
  expect_refused("a.laz", packed, ": ", "decompress the file first, e.g. with laszip");
  EXPECT_EQ(read("A.LAS", good).points.size(), 5u);
}

TEST_F(PointIo, LasTellsItsUnit) {
  constexpr double kFoot = 0.3048, kSurveyFoot = 1200.0 / 3937;
  const auto by_keys = [&](const std::vector<std::array<std::uint16_t, 4>>& keys, const std::string& doubles = "") {
    LasFile file = some_las();
    file.records = {{34736, doubles}, {34735, geo_keys(keys)}};
    return read("a.las", file.bytes()).unit;
  };
  EXPECT_EQ(by_keys({{3076, 0, 1, 9001}}), 1);
  EXPECT_EQ(by_keys({{1024, 0, 1, 1}, {3076, 0, 1, 9002}}), kFoot);
  EXPECT_EQ(by_keys({{3076, 0, 1, 9003}, {4099, 0, 1, 9003}}), kSurveyFoot);
  EXPECT_EQ(by_keys({{3072, 0, 1, 32633}}), 1);
  EXPECT_EQ(by_keys({{3072, 0, 1, 2240}}), 0);  // a code of survey feet that nothing here knows
  EXPECT_EQ(by_keys({{4099, 0, 1, 9001}}), 0);  // of z alone
  EXPECT_EQ(by_keys({}), 0);
  std::string doubles;
  append_bytes(doubles, 5.0);
  append_bytes(doubles, 0.01);
  EXPECT_EQ(by_keys({{3076, 0, 1, 32767}, {3077, 34736, 1, 1}}, doubles), 0.01);
  EXPECT_EQ(by_keys({{3076, 0, 1, 32767}, {3077, 34736, 1, 2}}, doubles), 0);  // beyond them
  EXPECT_TRUE(warnings_.empty());

  const std::string utm =
      "PROJCS[\"WGS 84 / UTM zone 33N\",GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.25]],"
      "UNIT[\"degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"scale_factor\",0.9996],"
      "UNIT[\"metre\",1,AUTHORITY[\"EPSG\",\"9001\"]],AXIS[\"Easting\",EAST]]";
  const std::string feet =
      "PROJCS[\"a [UNIT[\", GEOGCS[\"b\",UNIT[\"degree\",0.017]], UNIT[\"US survey foot\",0.3048006096012192]]";
  const std::string wkt2 =
      "PROJCRS[\"x\",BASEGEOGCRS[\"y\",DATUM[\"d\",ELLIPSOID[\"e\",6378137,298.25,LENGTHUNIT[\"metre\",1]]]],"
      "CONVERSION[\"c\",PARAMETER[\"False easting\",0,LENGTHUNIT[\"metre\",1]]],CS[Cartesian,2],"
      "AXIS[\"(E)\",east,ORDER[1],LENGTHUNIT[\"foot\",0.3048]],AXIS[\"(N)\",north,LENGTHUNIT[\"foot\",0.3048]]]";
  const auto by_wkt = [&](const std::string& text, bool extended) {
    LasFile file = some_las();
    file.minor = 4;
    file.wkt = true;
    std::vector<LasRecord>& records = extended ? file.extended : file.records;
    records.push_back({2112, text + std::string(1, '\0')});
    file.records.push_back({34735, geo_keys({{3076, 0, 1, 9036}})});  // the flag says that WKT counts
    return read("a.las", file.bytes()).unit;
  };
  for (const bool extended : {false, true}) {
    EXPECT_EQ(by_wkt(utm, extended), 1);
    EXPECT_NEAR(by_wkt(feet, extended), kSurveyFoot, 1e-15);
    EXPECT_EQ(by_wkt(wkt2, extended), kFoot);
    EXPECT_EQ(by_wkt("LOCAL_CS[\"l\",UNIT[\"millimetre\",0.001]]", extended), 0.001);
    EXPECT_EQ(by_wkt("COMPD_CS[\"c\"," + utm + ",VERT_CS[\"v\",UNIT[\"metre\",1]]]", extended), 1);
    EXPECT_EQ(by_wkt("PROJCS[\"p\",UNIT[\"nothing\"]]", extended), 0);
    EXPECT_EQ(by_wkt("PROJCS[\"p\",UNIT[\"US survey foot\",1.0]]", extended), 0);  // neither a foot nor a metre
    EXPECT_EQ(by_wkt("PROJCS[\"p\",UNIT[\"metre\",1],VERTCS[\"v\",UNIT[\"Foot_US\",1]]]", extended), 1);
    EXPECT_TRUE(warnings_.empty());
    EXPECT_EQ(by_wkt("]]PROJCS[UNIT[\"metre\",-1]]", extended), 0);
    EXPECT_EQ(by_wkt(std::string(500, '['), extended), 0);
  }
}

TEST_F(PointIo, HeightsAreInTheUnitOfTheOthers) {
  LasFile file = some_las();
  const std::vector<Vec3> raw = read("a.las", file.bytes()).points;
  file.records = {{34735, geo_keys({{3076, 0, 1, 9002}, {4099, 0, 1, 9001}})}};  // feet, z in metres
  const PointCloud cloud = read("a.las", file.bytes());
  EXPECT_EQ(cloud.unit, 0.3048);
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_NE(warnings_[0].find("z was converted"), std::string::npos);
  ASSERT_EQ(cloud.points.size(), raw.size());
  for (std::size_t i = 0; i < raw.size(); ++i) {
    EXPECT_EQ(cloud.points[i].x, raw[i].x);
    EXPECT_NEAR(cloud.points[i].z * 0.3048, raw[i].z, 1e-12 * std::abs(raw[i].z));
  }
  file.records = {{34735, geo_keys({{1024, 0, 1, 2}})}};
  expect_refused("a.las", file.bytes(), ": ", "degrees");
  file.records = {{2112, "GEOGCS[\"WGS 84\",UNIT[\"degree\",0.0174]]"}};
  expect_refused("a.las", file.bytes(), ": ", "degrees");
}

TEST_F(PointIo, DamagedRecordsOfLasCostTheUnitOnly) {
  LasFile file = some_las();
  file.minor = 4;
  file.records = {{34735, geo_keys({{3076, 0, 1, 9002}})}};
  file.extended = {{2112, "PROJCS[\"p\",UNIT[\"metre\",1]]"}};
  const std::string good = file.bytes();
  EXPECT_EQ(read("a.las", good).unit, 0.3048);
  const auto warned = [&](std::size_t at, auto value) {
    std::string bytes = good;
    put(bytes, at, value);
    EXPECT_EQ(read("a.las", bytes).points.size(), 5u);
    EXPECT_EQ(warnings_.size(), 1u) << at;
  };
  warned(100, std::uint32_t{0xFFFFFFFF});  // records
  warned(375 + 20, std::uint16_t{0xFFFF});
  warned(235, ~std::uint64_t{0} - 3);  // where the extended ones are
  warned(243, std::uint32_t{0xFFFFFFFF});
  warned(good.size() - file.extended[0].body.size() - 60 + 20, ~std::uint64_t{0});
}

TEST_F(PointIo, DamagedLasIsReadOrRefused) {
  LasFile file = some_las();
  file.minor = 4;
  file.format = 7;
  file.records = {{34735, geo_keys({{3076, 0, 1, 9002}})}};
  file.extended = {{2112, "PROJCS[\"p\",UNIT[\"metre\",1]]"}};
  expect_sturdy([](std::string_view bytes) { return io::read_las("a.las", bytes, {}); }, file.bytes());
}

// ---- PTS

TEST_F(PointIo, ReadsPts) {
  const std::vector<Vec3> one{{1, 2, 3}, {-0.5, 1e-3, 4}};
  EXPECT_EQ(read("a.pts", "2\n1 2 3\n-5e-1 .001 4\n").points, one);
  EXPECT_EQ(read("a.pts", "2 \r\n1 2 3 -1203 10 20 30\r\n-5e-1 .001 4 77\r\n\r\n").points, one);
  const std::vector<Vec3> three{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  EXPECT_EQ(read("a.PTS", "1\n1 2 3 0.5\n\n2\n4 5 6\n7 8 9\n0\n").points, three);
  std::string many;  // each scan alone
  for (int i = 0; i < 100'000; ++i) many += "1\n1 2 3\n";
  EXPECT_EQ(read("a.pts", many).points.size(), 100'000u);
}

TEST_F(PointIo, RefusesMalformedPts) {
  expect_refused("a.pts", "1 2 3\n", ":1: ", "begins with a line with its number of points");
  expect_refused("a.pts", "3\n1 2 3\n4 5 6\n", ":4: ", "the file ends after 2 of the 3 points of line 1");
  expect_refused("a.pts", "1\n1 2 3\n4 5 6\n", ":3: ", "more points than the 1 of line 1");
  expect_refused("a.pts", "2\n1 2 3\n2\n4 5 6\n7 8 9\n", ":3: ", "after 1 of the 2 points of line 1");
  expect_refused("a.pts", "1\n1 2 3\n2\n4 5 6\n", ":5: ", "the file ends after 1 of the 2 points of line 3");
  expect_refused("a.pts", "4294967290\n1 2 3\n", ":3: ", "the file ends");
  expect_refused("a.pts", "99999999999999999999\n1 2 3\n", ":1: ", "out of range");
  expect_refused("a.pts", "-1\n1 2 3\n", ":1: ", "negative");
  expect_refused("a.pts", "1.5\n1 2 3\n", ":1: ", "not an integer");
  expect_refused("a.pts", "1\n1 2\n", ":2: ", "a number is missing");
  expect_refused("a.pts", "1\n1 nan 2\n", ":2: ", "not finite");
  expect_refused("a.pts", "0\n", ":2: ", "no point at all");
  expect_refused("a.pts", "", ": ", "empty");
  expect_sturdy([](std::string_view bytes) { return io::read_pts("a.pts", bytes); },
                "2\n1 2 3 -7 255 0 1\n0.25 -1e3 4\n1\n5 6 7\n");
}

// ---- PCD

struct PcdField {
  std::string name;
  char type = 'F';
  int size = 4, count = 1;
};

void put_number(std::string& out, const PcdField& field, double value) {
  if (field.type == 'F' && field.size == 4) append_bytes(out, static_cast<float>(value));
  else if (field.type == 'F') append_bytes(out, value);
  else if (field.size == 1 && field.type == 'I') append_bytes(out, static_cast<std::int8_t>(value));
  else if (field.size == 1) append_bytes(out, static_cast<std::uint8_t>(value));
  else if (field.size == 2) append_bytes(out, static_cast<std::int16_t>(value));
  else if (field.size == 4) append_bytes(out, static_cast<std::int32_t>(value));
  else append_bytes(out, static_cast<std::int64_t>(value));
}

// A value of a field that is no coordinate.
double other_value(std::size_t point, int k) {
  return static_cast<double>((7 * point + static_cast<std::size_t>(k)) % 100);
}

double value_of(const PcdField& field, const Vec3& p, std::size_t point, int k) {
  return field.name == "x" ? p.x : field.name == "y" ? p.y : field.name == "z" ? p.z : other_value(point, k);
}

std::string pcd_header(const std::vector<PcdField>& fields, std::size_t points, const std::string& data) {
  std::string out = "# .PCD v.7 - Point Cloud Data file format\nVERSION .7\nFIELDS", sizes, types, counts;
  for (const PcdField& f : fields) {
    out += ' ' + f.name;
    sizes += ' ' + std::to_string(f.size);
    types += std::string(" ") + f.type;
    counts += ' ' + std::to_string(f.count);
  }
  const std::string n = std::to_string(points);
  return out + "\nSIZE" + sizes + "\nTYPE" + types + "\nCOUNT" + counts + "\nWIDTH " + n +
         "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA " + data + "\n";
}

// LZF: the longest match among the last 8192 bytes, or literals.
std::string compress_lzf(const std::string& in) {
  std::string out, literals;
  const auto flush = [&] {
    for (std::size_t i = 0; i < literals.size(); i += 32) {
      const std::string run = literals.substr(i, 32);
      out += static_cast<char>(run.size() - 1);
      out += run;
    }
    literals.clear();
  };
  for (std::size_t i = 0; i < in.size();) {
    std::size_t length = 0, back = 0;
    for (std::size_t b = 1; b <= std::min<std::size_t>(i, 8192); ++b) {
      std::size_t n = 0;
      while (n < 264 && i + n < in.size() && in[i + n] == in[i + n - b]) ++n;
      if (n > length) {
        length = n;
        back = b;
      }
    }
    if (length < 3) {
      literals += in[i++];
      continue;
    }
    flush();
    const std::size_t field = length - 2, distance = back - 1;
    out += static_cast<char>((std::min<std::size_t>(field, 7) << 5) | (distance >> 8));
    if (field >= 7) out += static_cast<char>(field - 7);
    out += static_cast<char>(distance & 255);
    i += length;
  }
  flush();
  return out;
}

std::string pcd(const std::vector<PcdField>& fields, const std::vector<Vec3>& points, const std::string& data) {
  std::string out = pcd_header(fields, points.size(), data), body;
  if (data == "ascii") {
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (const PcdField& f : fields)
        for (int k = 0; k < f.count; ++k) {
          const double value = value_of(f, points[i], i, k);
          out += (std::isnan(value) ? "nan" : std::to_string(value)) + ' ';
        }
      out += '\n';
    }
    return out;
  }
  if (data == "binary") {
    for (std::size_t i = 0; i < points.size(); ++i)
      for (const PcdField& f : fields)
        for (int k = 0; k < f.count; ++k) put_number(out, f, value_of(f, points[i], i, k));
    return out;
  }
  for (const PcdField& f : fields)
    if (f.name != "_")
      for (std::size_t i = 0; i < points.size(); ++i)
        for (int k = 0; k < f.count; ++k) put_number(body, f, value_of(f, points[i], i, k));
  const std::string packed = compress_lzf(body);
  append_bytes(out, static_cast<std::uint32_t>(packed.size()));
  append_bytes(out, static_cast<std::uint32_t>(body.size()));
  return out + packed;
}

const std::vector<std::vector<PcdField>> kLayouts{
    {{"x"}, {"y"}, {"z"}},
    {{"x", 'F', 8}, {"y", 'F', 8}, {"z", 'F', 8}},
    {{"intensity"}, {"z"}, {"rgb", 'U', 4}, {"x", 'F', 8}, {"fpfh", 'F', 4, 33}, {"y"}},
    {{"x"}, {"y"}, {"z"}, {"_", 'U', 1, 4}, {"normal_x"}, {"_", 'I', 1, 3}, {"label", 'U', 1}},
    {{"y", 'I', 2}, {"_", 'U', 1, 5}, {"z", 'I', 8}, {"x", 'I', 4}},
    {{"x", 'I', 1}, {"y", 'U', 1}, {"z", 'F', 4}},
};

// Whole numbers in a byte, which every type holds.
std::vector<Vec3> whole_points(std::size_t n) {
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < n; ++i)
    points.push_back({static_cast<double>(i % 5) - 2, static_cast<double>(i * i % 121), static_cast<double>(i % 50)});
  return points;
}

TEST_F(PointIo, ReadsPcdOfAllLayouts) {
  const std::vector<Vec3> points = whole_points(400);
  for (const auto& fields : kLayouts)
    for (const char* data : {"ascii", "binary", "binary_compressed"}) {
      const PointCloud cloud = read("a.pcd", pcd(fields, points, data));
      EXPECT_EQ(cloud.points, points) << data << ' ' << fields.size();
      EXPECT_EQ(cloud.unit, 0);
      EXPECT_TRUE(cloud.classification.empty());
      EXPECT_TRUE(warnings_.empty());
    }
}

TEST_F(PointIo, PcdKeepsTheBitsOfItsNumbers) {
  std::vector<Vec3> points;
  for (std::uint64_t i = 0; i < 300; ++i) {
    Random random(3, i);
    points.push_back({random.uniform() - 0.5, 1e6 * random.uniform(), 1e-9 * random.uniform()});
  }
  for (const char* data : {"binary", "binary_compressed"})
    EXPECT_EQ(read("a.pcd", pcd(kLayouts[1], points, data)).points, points) << data;
}

TEST_F(PointIo, PcdPointsWithoutReturnAreLeftOut) {
  std::vector<Vec3> points = whole_points(20);
  const std::vector<Vec3> kept = points;
  points.insert(points.begin() + 3, {kNan, kNan, kNan});
  points.push_back({1, 2, kNan});
  for (const char* data : {"ascii", "binary", "binary_compressed"}) {
    EXPECT_EQ(read("a.pcd", pcd(kLayouts[2], points, data)).points, kept) << data;
    ASSERT_EQ(warnings_.size(), 1u);
    EXPECT_NE(warnings_[0].find("2 points without a return"), std::string::npos);
    expect_refused("a.pcd", pcd(kLayouts[0], {{kNan, 0, 0}}, data), ": ", "all are NaN");
  }
}

TEST_F(PointIo, ReadsOldAndOrganisedPcd) {
  const std::vector<Vec3> expected{{1, 2, 3}, {4, 5, 6}};
  EXPECT_EQ(read("a.pcd", "COLUMNS x y z\nPOINTS 2\nDATA ascii\n1 2 3\n4 5 6\n").points, expected);
  EXPECT_EQ(
      read("a.pcd", "VERSION 0.5\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nDATA ascii\n1 2 3\n4 5 6\n").points,
      expected);
  EXPECT_EQ(read("a.pcd", "FIELDS x y z\r\nWIDTH 1\r\nHEIGHT 2\r\nDATA ascii\r\n1 2 3\r\n4 5 6\r\n").points, expected);
  read("a.pcd", "FIELDS x y z\nWIDTH 1\nDATA ascii\n1 2 3\n4 5 6\n7 8 9\n");
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_NE(warnings_[0].find("2 lines after the last point"), std::string::npos);
}

TEST_F(PointIo, RefusesMalformedPcd) {
  const std::string head = "FIELDS x y z\n";
  expect_refused("a.pcd", "ply\n", ":1: ", "unknown header line 'ply'");
  expect_refused("a.pcd", head, ":2: ", "the file ends");
  expect_refused("a.pcd", "FIELDS x y\nPOINTS 1\nDATA ascii\n1 2\n", ":3: ", "one 'z'");
  expect_refused("a.pcd", "FIELDS x y z z\nPOINTS 1\nDATA ascii\n1 2 3 4\n", ":3: ", "one 'z'");
  expect_refused("a.pcd", head + "SIZE 4 4\n", ":2: ", "'z'");
  expect_refused("a.pcd", head + "SIZE 4 3 4\n", ":2: ", "SIZE '3'");
  expect_refused("a.pcd", head + "TYPE F F C\n", ":2: ", "TYPE 'C'");
  expect_refused("a.pcd", head + "COUNT 1 0 1\n", ":2: ", "COUNT '0'");
  expect_refused("a.pcd", head + "COUNT 1 2 1\nPOINTS 1\nDATA ascii\n1 2 3 4\n", ":4: ", "'y' is not one number");
  expect_refused("a.pcd", head + "SIZE 2 4 4\nPOINTS 1\nDATA ascii\n1 2 3\n", ":4: ", "'x' is not one number");
  expect_refused("a.pcd", head + "DATA ascii\n1 2 3\n", ":2: ", "neither WIDTH nor POINTS");
  expect_refused("a.pcd", head + "WIDTH 3\nHEIGHT 2\nPOINTS 5\nDATA ascii\n1 2 3\n",
                 ":5: ", "3 times 2 points are not 5");
  expect_refused("a.pcd", head + "WIDTH 4294967294\nHEIGHT 4294967294\nDATA binary\n1234", ":4: ", "too many");
  expect_refused("a.pcd", head + "POINTS 0\nDATA ascii\n", ":3: ", "no point at all");
  expect_refused("a.pcd", head + "POINTS 1\nDATA text\n1 2 3\n", ":3: ", "DATA 'text'");
  expect_refused("a.pcd", head + "POINTS 2\nDATA ascii\n1 2 3\n", ":5: ", "1 of 2 points");
  expect_refused("a.pcd", head + "POINTS 1\nDATA ascii\n1 2\n", ":4: ", "a number is missing");
  expect_refused("a.pcd", head + "POINTS 1\nDATA ascii\n1 2 1e101\n", ": point 0", "1e100");
  expect_refused("a.pcd", "FIELDS x _ y z\nCOUNT 1 4000000000 1 1\nPOINTS 1\nDATA ascii\n1 2 3 4\n",
                 ":5: ", "ends early");
  expect_refused("a.pcd",
                 "FIELDS x _ y z\nSIZE 4 8 4 4\nCOUNT 1 4000000000 1 1\nPOINTS 1\nDATA binary\n1234567890123456", ": ",
                 "room for 0");
  expect_refused("a.pcd", head + "POINTS 4000000000\nDATA ascii\n1 2 3\n", ":5: ", "the file ends");
  expect_refused("a.pcd", head + "POINTS 4000000000\nDATA binary\n123456789012", ": ", "room for 1");
}

TEST_F(PointIo, RefusesDamagedCompression) {
  const auto file = [](std::size_t points, std::uint32_t packed, std::uint32_t size, const std::string& body) {
    std::string out = pcd_header(kLayouts[0], points, "binary_compressed");
    append_bytes(out, packed);
    append_bytes(out, size);
    return out + body;
  };
  const std::string literal(
      "\x0b"
      "abcdefghijkl",
      13);
  EXPECT_EQ(read("a.pcd", file(1, 13, 12, literal)).points.size(), 1u);
  expect_refused("a.pcd", file(1, 14, 12, literal), ": 14 bytes", "truncated");
  expect_refused("a.pcd", file(2, 13, 12, literal), ": 12 bytes", "2 points");
  expect_refused("a.pcd", file(1, 13, 13, literal), ": 13 bytes", "1 point");
  expect_refused("a.pcd", pcd_header(kLayouts[0], 1, "binary_compressed") + "abc", ": ", "truncated");
  for (const std::string& body : {std::string("\x0b"
                                              "abcdefghijk",
                                              12),  // literals beyond the end
                                  std::string("\x0a"
                                              "abcdefghijk",
                                              12),  // too few bytes
                                  std::string("\x0c"
                                              "abcdefghijklm",
                                              14),  // too many
                                  std::string("\x05"
                                              "abcdef\x80\x06",
                                              9),  // from before the beginning
                                  std::string("\x05"
                                              "abcdef\x80",
                                              8),  // half a copy
                                  std::string("\x05"
                                              "abcdef\xe0",
                                              8),  // a third of a long one
                                  std::string("\x05"
                                              "abcdef\xe0\x09\x00",
                                              10),              // a copy beyond the end
                                  std::string("\x80\x00", 2)})  // of nothing
    expect_refused("a.pcd", file(1, static_cast<std::uint32_t>(body.size()), 12, body), ": ",
                   "the compressed points are damaged");
  expect_refused("a.pcd", file(300'000'000, 13, 3'600'000'000u, literal), ": ", "damaged");
}

TEST_F(PointIo, DamagedPcdIsReadOrRefused) {
  for (const char* data : {"ascii", "binary", "binary_compressed"})
    expect_sturdy([](std::string_view bytes) { return io::read_pcd("a.pcd", bytes, {}); },
                  pcd(kLayouts[3], whole_points(12), data));
}

// ---- all

TEST_F(PointIo, OtherFormatsHaveNoUnitAndNoClasses) {
  const std::vector<Vec3> expected{{1, 2, 3}};
  for (const auto& [name, bytes] :
       {std::pair<const char*, std::string>{"a.xyz", "1 2 3\n"},
        {"a", "1 2 3 4 5 # normal\n"},
        {"a.ply",
         "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
         "end_header\n1 2 3\n"},
        {"a.pts", "1\n1 2 3\n"}}) {
    const PointCloud cloud = read(name, bytes);
    EXPECT_EQ(cloud.points, expected) << name;
    EXPECT_EQ(cloud.unit, 0);
    EXPECT_TRUE(cloud.classification.empty());
    EXPECT_EQ(read_points(store(name, bytes)), expected) << name;
  }
}

}  // namespace
}  // namespace bisector::test
