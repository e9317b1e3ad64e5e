// Runs that are cancelled again and again, and go on from their checkpoints, end in the same bits as those that are
// not.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bisector/checkpoint.h"
#include "bisector/cvt.h"
#include "bisector/error.h"
#include "bisector/remesh.h"
#include "bisector/tetmesh.h"
#include "support/diagram.h"
#include "support/files.h"
#include "support/models.h"
#include "support/solids.h"

namespace bisector::test {
namespace {

namespace fs = std::filesystem;

class Resume : public FileTest {
 protected:
  struct Pieces {
    int runs = 0;
    int most_reports = 0;  // of one run
  };

  std::string file() const { return path("run.ckpt"); }

  // Runs until nothing cancels it any more. Each run is cancelled when it has reported progress so many times, a few
  // times more than the last one.
  Pieces in_pieces(const std::function<void(const Context&)>& run, int reports) const {
    Pieces pieces;
    for (bool ended = false; !ended; ++pieces.runs) {
      std::atomic<bool> cancel = false;
      int left = reports + pieces.runs % 3, count = 0;
      CheckpointOptions options;
      options.every = 0;
      options.resume = true;
      Checkpoint checkpoint(file(), "", options);
      Context context;
      context.checkpoint = &checkpoint;
      context.cancel = &cancel;
      context.progress = [&](const Progress&) {
        ++count;
        if (--left < 0) cancel = true;
      };
      try {
        run(context);
        ended = true;
        checkpoint.remove();
      } catch (const Cancelled&) {
      }
      pieces.most_reports = std::max(pieces.most_reports, count);
      if (pieces.runs > 2000) {
        ADD_FAILURE() << "it does not get on";
        break;
      }
    }
    return pieces;
  }

  void expect_same(const TriangleMesh& mesh, RemeshOptions options, int reports) const {
    const RemeshResult whole = remesh(mesh, options);
    std::optional<RemeshResult> result;
    const Pieces pieces = in_pieces([&](const Context& context) { result = remesh(mesh, options, context); }, reports);
    EXPECT_GT(pieces.runs, 3);
    EXPECT_EQ(result->mesh.triangles, whole.mesh.triangles);
    EXPECT_TRUE(same_bits(result->mesh.vertices, whole.mesh.vertices));
    EXPECT_EQ(result->mesh.feature_edges, whole.mesh.feature_edges);
    EXPECT_EQ(result->energy, whole.energy);
    EXPECT_EQ(result->iterations, whole.iterations);
    EXPECT_EQ(result->improved.made, whole.improved.made);
  }
};

RemeshOptions with_vertices(std::size_t vertices) {
  RemeshOptions options;
  options.vertices = vertices;
  return options;
}

TEST_F(Resume, SmoothSurface) { expect_same(torus(48, 32), with_vertices(400), 25); }

TEST_F(Resume, SurfaceWithFeatures) { expect_same(box(6), with_vertices(500), 12); }

// Of several runs, some cells being no disks at first.
TEST_F(Resume, SheetsThatAreNear) {
  TriangleMesh mesh = box(4);
  for (Vec3& v : mesh.vertices) v.z *= 0.02;
  expect_same(mesh, with_vertices(300), 40);
}

TEST_F(Resume, SeedsOffTheSurface) {
  RemeshOptions options = with_vertices(300);
  options.energy = Energy::restricted;
  options.min_angle = 0;
  expect_same(icosphere(3), options, 10);
}

TEST_F(Resume, WithOtherThreads) {
  const TriangleMesh mesh = torus(48, 32);
  RemeshOptions options = with_vertices(400);
  const TriangleMesh whole = remesh(mesh, options).mesh;
  TriangleMesh result;
  in_pieces(
      [&](const Context& context) {
        options.threads = options.threads % 3 + 1;
        result = remesh(mesh, options, context).mesh;
      },
      20);
  EXPECT_EQ(result.triangles, whole.triangles);
  EXPECT_TRUE(same_bits(result.vertices, whole.vertices));
}

TEST_F(Resume, Tetrahedra) {
  TetOptions options;
  options.vertices = 300;
  const TetResult whole = tetrahedralise(box(3), options);
  std::optional<TetResult> result;
  const Pieces pieces =
      in_pieces([&](const Context& context) { result = tetrahedralise(box(3), options, context); }, 10);
  EXPECT_GT(pieces.runs, 3);
  EXPECT_EQ(result->mesh.tets, whole.mesh.tets);
  EXPECT_TRUE(same_bits(result->mesh.vertices, whole.mesh.vertices));
  EXPECT_EQ(result->mesh.boundary, whole.mesh.boundary);
  EXPECT_EQ(result->improved.moves, whole.improved.moves);
}

// Nothing that was computed is computed again: a run that has ended is gone through without the optimiser.
TEST_F(Resume, WhatHasEndedIsNotDoneAgain) {
  const TriangleMesh mesh = torus(48, 32);
  CheckpointOptions kept;
  kept.every = 0;
  kept.resume = true;
  int reports[2] = {0, 0};
  TriangleMesh results[2];
  for (int k = 0; k < 2; ++k) {
    Checkpoint checkpoint(file(), "", kept);
    EXPECT_EQ(checkpoint.empty(), k == 0);
    Context context;
    context.checkpoint = &checkpoint;
    context.progress = [&](const Progress& progress) { reports[k] += progress.iteration > 0; };
    results[k] = remesh(mesh, with_vertices(400), context).mesh;
  }
  EXPECT_GT(reports[0], 50);
  EXPECT_EQ(reports[1], 0);
  EXPECT_TRUE(same_bits(results[0].vertices, results[1].vertices));
}

// Another surface takes nothing from it, though the caller did not tell the two apart.
TEST_F(Resume, WhatStartsFromSomethingElseIsComputed) {
  CheckpointOptions kept;
  kept.resume = true;
  kept.every = 0;
  {
    Checkpoint checkpoint(file(), "", kept);
    Context context;
    context.checkpoint = &checkpoint;
    remesh(torus(48, 32), with_vertices(400), context);
  }
  Checkpoint checkpoint(file(), "", kept);
  Context context;
  context.checkpoint = &checkpoint;
  const TriangleMesh mesh = remesh(torus(40, 32), with_vertices(400), context).mesh;
  EXPECT_TRUE(same_bits(mesh.vertices, remesh(torus(40, 32), with_vertices(400)).mesh.vertices));
}

}  // namespace
}  // namespace bisector::test
