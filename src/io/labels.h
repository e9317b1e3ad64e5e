// Names of labels in files that have groups, solids, objects or materials instead of numbers.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bisector/io.h"
#include "io/mesh_formats.h"

namespace bisector::io {

// The label that a name tells, if it is one that label_names() makes: label_K, region_K or branch_K, or that and more
// after another "_". False if it tells none.
bool parse_label(std::string_view name, std::int32_t& label);

// A name without what a format has no place for: control characters and those of `forbidden` become "_".
std::string cleaned(std::string_view name, std::string_view forbidden = {});

// What the labels of a mesh are called in a file, each otherwise than the others: PREFIX_K_NAME where the options name
// them, else the mesh's own name, else PREFIX_K. One entry for each label that occurs.
LabelNames names_of_labels(const std::vector<std::int32_t>& labels, const LabelNames& own, const WriteOptions& options,
                           std::string_view forbidden = {});

// The labels of faces that a file puts into parts (groups, solids, objects) and gives materials: one for each pair of
// names that occurs.
class GroupLabels {
 public:
  void set_part(std::string name) { set(part_, std::move(name)); }
  void set_material(std::string name) { set(material_, std::move(name)); }
  // The next face has the part and the material that were set last.
  void add_face();
  // Nothing if all faces have the same pair, unless its name tells a label. Where the names of all pairs do, and each
  // another one, these; else numbers from 0 by first face, with the name of the part, of the material or of both,
  // whichever tells them apart. Of files that name files of materials also the materials.
  void take(Soup& soup);

 private:
  using Pair = std::pair<std::string, std::string>;

  void set(std::string& name, std::string value) {
    name = std::move(value);
    current_ = numbers_.end();
  }
  LabelNames names() const;

  std::string part_, material_;
  std::map<Pair, std::int32_t> numbers_;
  std::map<Pair, std::int32_t>::const_iterator current_ = numbers_.end();
  std::vector<std::int32_t> labels_;
};

}  // namespace bisector::io
