#include "job/parsed_option.h"

#include <iterator>
#include <sstream>

namespace bisector::job {
namespace {

// CLI11 finds validators by their names, which it shows nowhere: "words auto none", "files .off .obj".
constexpr const char* kWords = "words";
constexpr const char* kFiles = "files";

}  // namespace

CLI::Validator with_values(CLI::Validator validator, const OptionValues& values) {
  std::string name = values.file ? kFiles : kWords;
  for (const std::string& value : values.file ? values.extensions : values.words) name += ' ' + value;
  return validator.name(name);
}

OptionValues values_of(CLI::Option& option) {
  OptionValues values;
  std::istringstream name;
  try {
    name.str(option.get_validator(0)->get_name());
  } catch (const CLI::OptionNotFound&) {
    return values;  // it has no validator
  }
  std::string kind;
  name >> kind;
  const std::vector<std::string> listed{std::istream_iterator<std::string>(name), {}};
  values.file = kind == kFiles;
  if (values.file) values.extensions = listed;
  else if (kind == kWords) values.words = listed;
  return values;
}

}  // namespace bisector::job
