#include "job/outputs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "bisector/error.h"
#include "core/temporary_name.h"

namespace bisector::job {
namespace {

namespace fs = std::filesystem;

bool is_special(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

void check_extension(const Output& output) {
  if (output.extensions.empty()) return;
  const std::string extension = extension_of(output.path);
  if (std::find(output.extensions.begin(), output.extensions.end(), extension) == output.extensions.end())
    throw Error(fmt::format("{}: '{}' is not a format that can be written here; use {}", output.path, extension,
                            fmt::join(output.extensions, ", ")));
}

void check_writable(const std::string& path) {
  const fs::path target = target_of(path);
  std::error_code error;
  if (path.back() == '/' || fs::is_directory(target, error)) throw Error(path + ": is a directory; name a file");
  if (is_special(target)) {
    if (access(target.c_str(), W_OK) != 0)
      throw Error(fmt::format("{}: cannot be written: {}; name another file", path, std::strerror(errno)));
    return;
  }
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, error))
    throw Error(fmt::format("{}: the folder {} does not exist; create it first", path, folder.string()));
  // Permissions do not tell all: a file system may be read-only or full.
  const fs::path trial = folder / temporary_name();
  const int descriptor = open(trial.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (descriptor < 0)
    throw Error(fmt::format("{}: the folder {} cannot be written to: {}; choose another", path, folder.string(),
                            std::strerror(errno)));
  close(descriptor);
  unlink(trial.c_str());
  if (access(target.c_str(), F_OK) != 0 && errno == ENAMETOOLONG) throw Error(path + ": the name is too long");
}

}  // namespace

fs::path target_of(const std::string& path) {
  std::error_code error;
  const fs::path target = fs::weakly_canonical(fs::absolute(path, error), error);
  return error ? fs::path(path) : target;
}

std::string extension_of(const std::string& path) {
  std::string extension = fs::path(path).extension();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension;
}

std::string with_extensions(const std::string& text, const std::vector<std::string>& extensions) {
  constexpr std::size_t kWidth = 57;  // of the help's column
  std::string lines = text + ":";
  std::size_t line = lines.rfind('\n') + 1;  // where the last one starts
  const std::string words = listed(extensions);
  for (std::size_t at = 0; at < words.size();) {
    const std::size_t end = std::min(words.find(' ', at), words.size());
    const bool full = lines.size() - line + 1 + (end - at) > kWidth;
    lines += full ? '\n' : ' ';
    if (full) line = lines.size();
    lines += words.substr(at, end - at);
    at = end + 1;
  }
  return lines;
}

std::string lost_labels(const std::string& path, bool named, const char* labels) {
  using Labels = FileFormat::Labels;
  const std::string extension = extension_of(path);
  std::vector<std::string> holders;
  Labels held = Labels::none;
  for (const FileFormat& format : file_formats()) {
    if (format.extension == extension) held = format.labels;
    if (format.labels == Labels::all && format.writes_surfaces) holders.emplace_back(format.extension);
  }
  if (held == Labels::all || (held == Labels::named && named)) return {};
  return fmt::format("{}: {} files hold no face labels{}, {} are lost; write {}", path, extension,
                     held == Labels::named ? " without names" : "", labels, listed(holders));
}

std::string loss_of_attributes(const std::string& path, const std::vector<Attribute>& attributes,
                               const std::vector<std::string>& formats) {
  const std::vector<std::string> lost = lost_attributes(path, attributes);
  if (lost.empty()) return {};
  std::vector<std::string> holders;
  for (const std::string& extension : formats)
    if (lost_attributes("x" + extension, attributes).empty()) holders.push_back(extension);
  return fmt::format("{}: {} files have no place for {}, which {} lost{}", path, extension_of(path),
                     fmt::join(lost, ", "), lost.size() == 1 ? "is" : "are",
                     holders.empty() ? "" : "; write " + listed(holders));
}

void check_outputs(const std::vector<Output>& outputs, const std::vector<std::string>& inputs) {
  std::vector<fs::path> taken;
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    const std::string& path = outputs[k].path;
    if (path.empty()) continue;
    if (path == "-") throw Error("-: only a report can be written to stdout; name a file");
    check_extension(outputs[k]);
    check_writable(path);
    const fs::path target = target_of(path);
    if (is_special(target)) continue;
    if (std::find(taken.begin(), taken.end(), target) != taken.end())
      throw Error(path + ": two outputs have this name; choose another");
    taken.push_back(target);
    for (const std::string& input : inputs)
      if (k > 0 && !input.empty() && target_of(input) == target)
        throw Error(path + ": would replace an input; choose another name");
  }
}

}  // namespace bisector::job
