#include "io/formats.h"

#include <vector>

#include "bisector/attributes.h"

namespace bisector {

using namespace io;

namespace {

using Labels = FileFormat::Labels;

using Site = Attribute::Site;

bool is_shown(const Attribute& attribute) {
  const AttributeMeaning meaning = meaning_of(attribute);
  return meaning == AttributeMeaning::texture ||
         (meaning == AttributeMeaning::colour && attribute.site == Site::vertex);
}

// What each format has places for.
bool obj_holds(const Attribute& attribute) { return attribute.site != Site::element && is_shown(attribute); }
bool ply_holds(const Attribute& attribute) {
  return attribute.site != Site::corner || meaning_of(attribute) == AttributeMeaning::texture;
}
bool glb_holds(const Attribute& attribute) {
  return obj_holds(attribute) || (attribute.site == Site::vertex && meaning_of(attribute) == AttributeMeaning::normal);
}
bool vtk_holds(const Attribute& attribute) { return attribute.site != Site::corner; }

constexpr Format kFormats[] = {
    {".off", Labels::none, nullptr, read_off, nullptr, format_off, format_off},
    {".obj", Labels::all, obj_holds, read_obj, nullptr, format_obj, format_obj},
    {".ply", Labels::all, ply_holds, read_ply, nullptr, format_ply, format_ply},
    {".stl", Labels::named, nullptr, read_stl, nullptr, format_stl},
    {".3mf", Labels::all, nullptr, read_3mf, nullptr, format_3mf},
    {".glb", Labels::all, glb_holds, nullptr, nullptr, format_glb},
    {".vtp", Labels::all, vtk_holds, read_vtp, nullptr, format_vtp, format_vtp},
    {".mesh", Labels::all, nullptr, nullptr, read_medit, nullptr, nullptr, format_medit},
    {".meshb", Labels::all, nullptr, nullptr, read_medit_binary, nullptr, nullptr, format_medit_binary},
    {".msh", Labels::all, nullptr, nullptr, read_gmsh, nullptr, nullptr, format_gmsh, true},
    {".vtu", Labels::all, vtk_holds, nullptr, read_vtu, format_vtu, nullptr, format_vtu, true},
    {".vtk", Labels::all, nullptr, nullptr, read_vtk},
};

FileFormat told(const Format& format) {
  FileFormat told;
  told.extension = format.extension;
  told.reads_surfaces = format.read || format.read_tets;
  told.writes_surfaces = format.bytes_of || format.bytes_of_tets;
  told.writes_polygons = format.bytes_of_polygons;
  told.reads_tets = format.read_tets;
  told.writes_tets = format.bytes_of_tets;
  told.writes_second_order = format.has_second_order;
  told.labels = format.labels;
  return told;
}

}  // namespace

const std::vector<FileFormat>& file_formats() {
  static const std::vector<FileFormat> formats = [] {
    std::vector<FileFormat> all;
    for (const Format& format : kFormats) all.push_back(told(format));
    return all;
  }();
  return formats;
}

std::vector<std::string> extensions_that(bool FileFormat::*use) {
  std::vector<std::string> extensions;
  for (const FileFormat& format : file_formats())
    if (format.*use) extensions.emplace_back(format.extension);
  return extensions;
}

std::vector<std::string> lost_attributes(const std::string& path, const std::vector<Attribute>& attributes) {
  const std::string extension = lower_extension(path);
  bool (*holds)(const Attribute&) = nullptr;
  for (const Format& format : kFormats)
    if (format.extension == extension) holds = format.holds;
  std::vector<std::string> lost;
  for (const Attribute& attribute : attributes)
    if (!holds || !holds(attribute)) lost.push_back(attribute.name);
  return lost;
}

std::string listed(const std::vector<std::string>& names) {
  std::string list;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (k > 0) list += k + 1 < names.size() ? ", " : " or ";
    list += names[k];
  }
  return list;
}

const Format& io::format_of(const std::string& path, bool FileFormat::*use, const char* what) {
  const std::string extension = lower_extension(path), known = listed(extensions_that(use));
  if (extension.empty()) fail(path, "no file name extension; use " + known);
  for (const Format& format : kFormats)
    if (format.extension == extension && told(format).*use) return format;
  fail(path, fmt::format("unknown format '{}' of {}; use {}", printable(extension), what, known));
}

}  // namespace bisector
