#include "io/formats.h"

#include <vector>

namespace bisector {

using namespace io;

namespace {

using Labels = FileFormat::Labels;

constexpr Format kFormats[] = {
    {".off", Labels::none, read_off, nullptr, format_off, format_off},
    {".obj", Labels::all, read_obj, nullptr, format_obj, format_obj},
    {".ply", Labels::all, read_ply, nullptr, format_ply, format_ply},
    {".stl", Labels::named, read_stl, nullptr, format_stl},
    {".3mf", Labels::all, read_3mf, nullptr, format_3mf},
    {".glb", Labels::all, nullptr, nullptr, format_glb},
    {".vtp", Labels::all, read_vtp, nullptr, format_vtp, format_vtp},
    {".mesh", Labels::all, nullptr, read_medit, nullptr, nullptr, format_medit},
    {".meshb", Labels::all, nullptr, read_medit_binary, nullptr, nullptr, format_medit_binary},
    {".msh", Labels::all, nullptr, read_gmsh, nullptr, nullptr, format_gmsh},
    {".vtu", Labels::all, nullptr, read_vtu, nullptr, nullptr, format_vtu},
    {".vtk", Labels::all, nullptr, read_vtk},
};

FileFormat told(const Format& format) {
  FileFormat told;
  told.extension = format.extension;
  told.reads_surfaces = format.read || format.read_tets;
  told.writes_surfaces = format.bytes_of || format.bytes_of_tets;
  told.writes_polygons = format.bytes_of_polygons;
  told.reads_tets = format.read_tets;
  told.writes_tets = format.bytes_of_tets;
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
