#include "io/labels.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <set>
#include <system_error>

namespace bisector::io {

bool parse_label(std::string_view name, std::int32_t& label) {
  for (const std::string_view prefix : {"label_", "region_", "branch_"}) {
    if (!name.starts_with(prefix)) continue;
    const char *begin = name.data() + prefix.size(), *end = name.data() + name.size();
    const auto [stop, error] = std::from_chars(begin, end, label);
    return error == std::errc{} && (stop == end || *stop == '_');
  }
  return false;
}

std::string cleaned(std::string_view name, std::string_view forbidden) {
  std::string clean(name);
  for (char& c : clean)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f || forbidden.find(c) != std::string_view::npos) c = '_';
  return clean;
}

LabelNames names_of_labels(const std::vector<std::int32_t>& labels, const LabelNames& own, const WriteOptions& options,
                           std::string_view forbidden) {
  LabelNames names;
  std::set<std::string> taken;
  for (const std::int32_t label : std::set<std::int32_t>(labels.begin(), labels.end())) {
    std::string name = fmt::format("{}_{}", options.prefix, label);
    if (!options.names.empty()) {
      name += '_' + options.names[static_cast<std::size_t>(label)];
    } else if (const auto found = own.find(label); found != own.end() && !found->second.empty()) {
      name = cleaned(found->second, forbidden);
      while (taken.count(name) > 0) name += fmt::format("_{}", label);
    }
    taken.insert(name);
    names[label] = std::move(name);
  }
  return names;
}

void GroupLabels::add_face() {
  if (current_ == numbers_.end())
    current_ = numbers_.try_emplace({part_, material_}, static_cast<std::int32_t>(numbers_.size())).first;
  labels_.push_back(current_->second);
}

LabelNames GroupLabels::names() const {
  std::set<std::string> parts, materials;
  for (const auto& [pair, number] : numbers_) {
    parts.insert(pair.first);
    materials.insert(pair.second);
  }
  LabelNames names;
  for (const auto& [pair, number] : numbers_) {
    const auto& [part, material] = pair;
    std::string name = part.empty() || material.empty()      ? part + material
                       : parts.size() == numbers_.size()     ? part
                       : materials.size() == numbers_.size() ? material
                                                             : part + '_' + material;
    if (!name.empty()) names[number] = std::move(name);
  }
  return names;
}

void GroupLabels::take(Soup& soup) {
  if (labels_.empty()) return;
  LabelNames names = this->names();
  std::vector<std::int32_t> told(numbers_.size());
  const bool all_told = names.size() == told.size() && std::all_of(names.begin(), names.end(), [&](const auto& entry) {
                          return parse_label(entry.second, told[static_cast<std::size_t>(entry.first)]);
                        });
  const bool renumbered = all_told && std::set<std::int32_t>(told.begin(), told.end()).size() == told.size();
  if (!soup.material_files.empty())
    for (const auto& [pair, number] : numbers_)
      if (!pair.second.empty())
        soup.label_materials[renumbered ? told[static_cast<std::size_t>(number)] : number] = pair.second;
  if (renumbered) {
    for (std::int32_t& label : labels_) label = told[static_cast<std::size_t>(label)];
    names.clear();
  } else if (numbers_.size() < 2) {
    return;
  }
  soup.label_names = std::move(names);
  soup.labels = std::move(labels_);
}

}  // namespace bisector::io
