#include "job/job.h"

#include "job/quality.h"
#include "job/remesh.h"
#include "job/rvd.h"
#include "job/segment.h"
#include "job/tet.h"
#include "job/tree.h"

namespace bisector::job {
namespace {

template <class AnyJob>
std::unique_ptr<Job> make() {
  return std::make_unique<AnyJob>();
}

constexpr std::unique_ptr<Job> (*kMakers[])() = {make<RemeshJob>,  make<RvdJob>,  make<TetJob>,
                                                 make<SegmentJob>, make<TreeJob>, make<QualityJob>};

}  // namespace

std::unique_ptr<Job> make_job(std::string_view command) {
  for (const auto& maker : kMakers)
    if (std::unique_ptr<Job> job = maker(); job->command() == command) return job;
  return nullptr;
}

std::string known_commands() {
  std::string list;
  for (const auto& maker : kMakers) list += (list.empty() ? "" : ", ") + std::string(maker()->command());
  return list;
}

}  // namespace bisector::job
