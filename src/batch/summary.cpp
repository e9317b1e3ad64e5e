#include "batch/summary.h"

#include <map>
#include <utility>

#include "io/files.h"

namespace bisector::batch {
namespace {

using job::Json;

// What a row has of a report, by JSON pointer.
constexpr std::pair<const char*, const char*> kOfReport[] = {
    {"vertices", "/output/vertices"},
    {"faces", "/output/faces"},
    {"tets", "/output/tets"},
    {"regions", "/output/regions"},
    {"q_min", "/quality/q_min"},
    {"q_ave", "/quality/q_ave"},
    {"theta_min", "/quality/theta_min"},
    {"dihedral_min", "/quality/dihedral_min"},
    {"distance_rms", "/quality/distance_rms"},
    {"distance_max", "/quality/distance_max"},
    {"matches_input", "/topology/matches_input"},
};

Json row_of(const BatchJob& job, const Json& record) {
  Json row{{"name", job.name}, {"command", job.given["command"]}, {"input", job.input}, {"status", "waiting"}};
  if (record.is_null()) return row;
  row["status"] = record["status"];
  for (const char* key : {"exit_code", "signal", "seconds", "memory_mib"})
    if (record.contains(key)) row[key] = record[key];
  const Json report = record.value("report", Json());
  if (report.is_object()) {
    for (const auto& [key, path] : kOfReport) {
      const Json::json_pointer pointer(path);
      if (!report.contains(pointer)) continue;
      const Json& value = report[pointer];
      if (value.is_primitive() && !value.is_null()) row[key] = value;
    }
    if (report.contains("warnings")) row["warnings"] = report["warnings"].size();
  }
  if (record.contains("message")) row["message"] = record["message"];
  return row;
}

std::string csv_cell(const Json& value) {
  const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

}  // namespace

Json summary_of(const std::vector<BatchJob>& jobs, const std::vector<Json>& records) {
  std::map<std::string, std::size_t> counts;
  Json rows = Json::array(), failed = Json::array();
  for (std::size_t k = 0; k < jobs.size(); ++k) {
    rows.push_back(row_of(jobs[k], records[k]));
    const Json& row = rows.back();
    ++counts[row["status"]];
    if (row.contains("message"))
      failed.push_back({{"name", row["name"]}, {"status", row["status"]}, {"message", row["message"]}});
  }
  Json summary = job::start_report("batch");
  summary["jobs"] = jobs.size();
  for (const auto& [status, count] : counts) summary["statuses"][status] = count;
  summary["failed"] = std::move(failed);
  summary["rows"] = std::move(rows);
  return summary;
}

std::string csv_of(const Json& summary) {
  std::vector<std::string> columns{"name",      "command", "input",   "status",
                                   "exit_code", "signal",  "seconds", "memory_mib"};
  for (const auto& entry : kOfReport) columns.emplace_back(entry.first);
  columns.insert(columns.end(), {"warnings", "message"});
  std::string csv;
  for (const std::string& column : columns) csv += (csv.empty() ? "" : ",") + column;
  csv += "\r\n";
  for (const Json& row : summary["rows"]) {
    for (std::size_t k = 0; k < columns.size(); ++k) {
      if (k > 0) csv += ',';
      if (row.contains(columns[k])) csv += csv_cell(row[columns[k]]);
    }
    csv += "\r\n";
  }
  return csv;
}

void write_summary(const std::string& folder, const Json& summary) {
  write_file(folder + "/summary.csv", csv_of(summary));
  for (const char* name : {"/summary.json", "/summary.html"}) job::write_report(folder + name, summary, {});
}

}  // namespace bisector::batch
