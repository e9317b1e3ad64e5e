// Finding out before a long computation what would keep its outputs from being written after it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bisector/io.h"

namespace bisector::job {

struct Output {
  std::string path;                     // empty: not wanted
  std::vector<std::string> extensions;  // the formats that can be written; empty: any name
};

std::string extension_of(const std::string& path);  // in lower case, with the dot

// Where the bytes of a path go, by its one name: links are followed.
std::filesystem::path target_of(const std::string& path);

// A report that goes to stdout needs no check.
inline Output report_output(const std::string& path) { return {path == "-" ? "" : path, {}}; }

// Throws Error if a format is unknown, a path is "-", a folder is missing or not writable, two outputs share a name, or
// an output other than the first would replace an input.
void check_outputs(const std::vector<Output>& outputs, const std::vector<std::string>& inputs);

// Extensions of meshes that are read and written, from the library's table.
inline const std::vector<std::string> kMeshInputs = extensions_that(&FileFormat::reads_surfaces);
inline const std::vector<std::string> kTetInputs = extensions_that(&FileFormat::reads_tets);
inline const std::vector<std::string> kMeshFormats = extensions_that(&FileFormat::writes_surfaces);
inline const std::vector<std::string> kPolygonFormats = extensions_that(&FileFormat::writes_polygons);
inline const std::vector<std::string> kTetFormats = extensions_that(&FileFormat::writes_tets);
inline const std::vector<std::string> kReportFormats{".json", ".html"};
inline const std::vector<std::string> kIgesFormats{".igs", ".iges"};
inline const std::vector<std::string> kTreeFormats = [] {
  std::vector<std::string> formats = kMeshFormats;
  formats.insert(formats.end(), kIgesFormats.begin(), kIgesFormats.end());
  return formats;
}();

// "TEXT: .off, .obj or .ply" in lines for the help of an option.
std::string with_extensions(const std::string& text, const std::vector<std::string>& extensions);

// What to warn of if a file of this name loses labels of faces, "the regions" or the like; empty if it holds them.
// `named`: they have names.
std::string lost_labels(const std::string& path, bool named, const char* labels);

// What to warn of if a file of this name has no place for some of these attributes; empty if it has for all. `formats`:
// the extensions that it might have.
std::string loss_of_attributes(const std::string& path, const std::vector<Attribute>& attributes,
                               const std::vector<std::string>& formats);

}  // namespace bisector::job
