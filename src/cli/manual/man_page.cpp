#include "cli/manual/man_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

namespace bisector::cli::manual {
namespace {

bool is_upper(char c) { return std::isupper(static_cast<unsigned char>(c)) != 0; }
bool is_alphanumeric(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

// Text for roff. A dash that begins a word is a minus sign, one inside a hyphen, but for the words of options.
std::string escaped(std::string_view text) {
  std::string out;
  bool is_option = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char before = i == 0 ? ' ' : text[i - 1];
    if (!is_alphanumeric(before) && before != '-') is_option = false;
    switch (text[i]) {
      case '\\': out += "\\e"; break;
      case '^': out += "\\(ha"; break;
      case '~': out += "\\(ti"; break;
      case '`': out += "\\(ga"; break;
      case '-': {
        const bool before_digit = i + 1 < text.size() && std::isdigit(static_cast<unsigned char>(text[i + 1])) != 0;
        is_option = is_option || !is_alphanumeric(before);
        out += is_option || before_digit ? "\\-" : "-";
        break;
      }
      default: out += text[i];
    }
  }
  return out;
}

// The name of a page: its dashes are minus signs, at which no line is broken.
std::string page_name(const std::string& name) {
  std::string out;
  for (const char c : name) out += c == '-' ? "\\-" : std::string(1, c);
  return out;
}

// A line of text; one that begins with a dot or an apostrophe would be a request.
std::string text_line(std::string_view text) {
  const std::string line = escaped(text);
  return (line.starts_with('.') || line.starts_with('\'') ? "\\&" : "") + line + "\n";
}

std::string bold(std::string_view text) { return "\\fB" + escaped(text) + "\\fR"; }
std::string italic(std::string_view text) { return "\\fI" + escaped(text) + "\\fR"; }

// A usage line: what is to be replaced is in italics, marks are plain, all else is bold.
std::string usage_line(const std::string& usage) {
  std::string out, word;
  const auto end_word = [&] {
    if (word.empty()) return;
    const bool is_placeholder = is_upper(word.front()) || word == "options";
    out += is_placeholder ? italic(word) : bold(word);
    word.clear();
  };
  for (const char c : usage) {
    if (std::string_view(" []|").find(c) == std::string_view::npos && !(c == '.' && word.empty())) {
      word += c;
      continue;
    }
    end_word();
    out += c;
  }
  end_word();
  return out + "\n";
}

std::string option_tag(const Option& option) {
  if (option.is_argument()) return italic(option.name) + "\n";
  std::string type = option.type;
  if (option.optional_value) {
    std::erase_if(type, [](char c) { return c == '[' || c == ']'; });
    return bold(option.name) + "[=" + italic(type) + "]\n";
  }
  const std::string alias = option.alias.empty() ? "" : bold(option.alias) + ", ";
  return alias + bold(option.name) + (type.empty() ? "" : " " + italic(type)) + "\n";
}

std::string tagged(const std::string& tag, const std::string& text) { return ".TP\n" + tag + text_line(text); }

std::string option_paragraph(const Option& option) {
  return tagged(option_tag(option), option.help + (option.required ? " (required)." : "."));
}

// Arguments, then the groups in the order in which they first appear.
std::string options_section(const std::vector<Option>& options) {
  if (options.empty()) return "";
  std::string out = ".SH OPTIONS\n";
  if (options.front().is_argument()) out += ".SS Arguments\n";
  std::vector<std::string> groups;
  for (const Option& option : options) {
    if (option.is_argument()) out += option_paragraph(option);
    else if (std::find(groups.begin(), groups.end(), option.group) == groups.end()) groups.push_back(option.group);
  }
  for (const std::string& group : groups) {
    if (options.front().is_argument()) out += ".SS " + escaped(group) + "\n";
    for (const Option& option : options)
      if (!option.is_argument() && option.group == group) out += option_paragraph(option);
  }
  return out;
}

std::string examples_section(const std::vector<Example>& examples) {
  std::string out;
  for (const Example& example : examples) {
    std::string about = example.about;
    about.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(about.front())));
    out += tagged(bold(example.line) + "\n", about.ends_with('.') ? about : about + ".");
  }
  return out.empty() ? "" : ".SH EXAMPLES\n" + out;
}

std::string exit_section(const Entry& entry) {
  if (entry.exit_codes.empty()) return "";
  std::string out = ".SH EXIT STATUS\n";
  for (const ExitCode& code : entry.exit_codes)
    out += tagged(bold(fmt::to_string(code.code)) + "\n", code.meaning + std::string("."));
  if (!entry.no_output.empty()) out += ".PP\n" + text_line(entry.no_output);
  return out;
}

std::string environment_section(const Entry& entry, const std::vector<EnvironmentVariable>& environment) {
  std::string out;
  for (const EnvironmentVariable& variable : environment) {
    const bool is_read = std::count(variable.commands.begin(), variable.commands.end(), entry.command) > 0;
    if (is_read || entry.name == "bisector") out += tagged(bold(variable.name) + "\n", variable.meaning + ".");
  }
  return out.empty() ? "" : ".SH ENVIRONMENT\n" + out;
}

std::string commands_section(const std::vector<Entry>& entries) {
  std::string out = ".SH COMMANDS\n";
  for (const Entry& entry : entries)
    if (!entry.command.empty()) out += tagged(bold(entry.command) + "\n", entry.about);
  return out + ".PP\n" + text_line("Each has a page of its own, such as bisector-remesh(1).");
}

std::string see_also_section(const std::vector<Entry>& entries, std::size_t which) {
  std::vector<std::string> names;
  for (const Entry& entry : entries)
    if (&entry != &entries[which]) names.push_back(entry.name);
  std::sort(names.begin(), names.end());
  std::string out = ".SH SEE ALSO\n";
  for (const std::string& name : names)
    out += fmt::format(".BR {} (1){}\n", page_name(name), name == names.back() ? "" : ",");
  return out;
}

// "Make a mesh." to "make a mesh".
std::string name_line(const Entry& entry) {
  std::string about = entry.about;
  if (about.ends_with('.')) about.pop_back();
  about.front() = static_cast<char>(std::tolower(static_cast<unsigned char>(about.front())));
  return fmt::format("{} \\- {}\n", page_name(entry.name), escaped(about));
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

}  // namespace

std::string man_page(const std::vector<Entry>& entries, std::size_t which,
                     const std::vector<EnvironmentVariable>& environment, const std::string& date) {
  const Entry& entry = entries[which];
  std::string page = fmt::format(".TH {} 1 \"{}\" \"Bisector {}\" \"User Commands\"\n.nh\n.ad l\n",
                                 page_name(upper(entry.name)), date, BISECTOR_VERSION);
  page += ".SH NAME\n" + name_line(entry);
  page += ".SH SYNOPSIS\n" + usage_line(entry.usage);
  page += ".SH DESCRIPTION\n";
  for (std::size_t i = 0; i < entry.description.size(); ++i)
    page += (i == 0 ? "" : ".PP\n") + text_line(entry.description[i]);
  if (which == 0) page += commands_section(entries);
  page += options_section(entry.options);
  page += examples_section(entry.examples);
  page += exit_section(entry);
  page += environment_section(entry, environment);
  return page + see_also_section(entries, which);
}

}  // namespace bisector::cli::manual
