#include "view/page.h"

#include <string_view>

#include "core/base64.h"
#include "view/payload.h"

namespace bisector::view {

// viewer/dist/report.html, by cmake/EmbedPage.cmake.
extern const std::string_view page_template;

namespace {

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else out += c;
  }
  return out;
}

void replace(std::string& text, std::string_view mark, std::string_view by) {
  text.replace(text.find(mark), mark.size(), by);
}

}  // namespace

std::string report_page(const std::string& title, const std::string& report, const Scene& scene) {
  std::string page(page_template);
  replace(page, "{{data}}", base64(encode(scene, report)));
  replace(page, "{{title}}", escaped(title));
  return page;
}

}  // namespace bisector::view
