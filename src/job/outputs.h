// Finding out before a long computation what would keep its outputs from being written after it.
#pragma once

#include <string>
#include <vector>

namespace bisector::job {

struct Output {
  std::string path;                     // empty: not wanted
  std::vector<std::string> extensions;  // the formats that can be written; empty: any name
};

std::string extension_of(const std::string& path);  // in lower case, with the dot

// A report that goes to stdout needs no check.
inline Output report_output(const std::string& path) { return {path == "-" ? "" : path, {}}; }

// Throws Error if a format is unknown, a path is "-", a folder is missing or not writable, two outputs share a name, or
// an output other than the first would replace an input.
void check_outputs(const std::vector<Output>& outputs, const std::vector<std::string>& inputs);

inline const std::vector<std::string> kMeshFormats{".off", ".obj", ".ply", ".stl"};  // read, too
inline const std::vector<std::string> kPolygonFormats{".obj", ".ply", ".off"};
inline const std::vector<std::string> kTreeFormats{".obj", ".ply", ".off", ".stl", ".igs", ".iges"};
inline const std::vector<std::string> kTetFormats{".mesh", ".msh", ".vtu"};
inline const std::vector<std::string> kReportFormats{".json", ".html"};
// What is read where a surface or tetrahedra will do.
inline const std::vector<std::string> kDomainFormats{".off", ".obj", ".ply", ".stl", ".mesh", ".msh", ".vtk", ".vtu"};

}  // namespace bisector::job
