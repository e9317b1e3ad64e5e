#include "step/shell.h"

#include <fmt/format.h>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeSolid.hxx>
#include <BRepBuilderAPI_Sewing.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRepClass3d_SolidClassifier.hxx>
#include <BRepGProp.hxx>
#include <BRepLib.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <GProp_GProps.hxx>
#include <ShapeBuild_ReShape.hxx>
#include <ShapeFix_Edge.hxx>
#include <ShapeFix_Face.hxx>
#include <ShapeFix_Shape.hxx>
#include <Standard_Failure.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <TopoDS_Wire.hxx>

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include "step/edges.h"
#include "step/surfaces.h"

namespace bisector::step {
namespace {

constexpr double kLargestGap = 0.01;     // between edges and faces, of the diagonal: what is off by more stays a flaw
constexpr double kAreaTolerance = 0.05;  // a face whose area is farther off its region's has gone wrong

Outline outline_of(const Trims& trims, const Region& region) {
  Outline outline;
  outline.area = region.area;
  for (const std::vector<Use>& loop : region.loops) {
    std::vector<Vec3>& points = outline.loops.emplace_back();
    for (const Use& use : loop) {
      const std::vector<Vec3>& chain = trims.chains[use.chain].points;
      if (use.reversed) points.insert(points.end(), chain.rbegin(), chain.rend());
      else points.insert(points.end(), chain.begin(), chain.end());
    }
    outline.points.insert(outline.points.end(), points.begin(), points.end());
  }
  return outline;
}

// Trimmed by the region's loops, without curves in the surface's parameters. Null for a pair of planes.
TopoDS_Face trimmed_face(const Trims& trims, const Region& region, const std::vector<TopoDS_Edge>& edges,
                         bool as_patch) {
  bool flipped = false;
  const Outline outline = outline_of(trims, region);
  const Handle(Geom_Surface) surface =
      as_patch ? make_patch(std::get<GeneralQuadric>(region.surface), outline, region.same_sense, flipped)
               : make_surface(region.surface, outline, flipped);
  if (surface.IsNull()) return {};
  const bool forward = region.same_sense != flipped;
  TopoDS_Face face;
  BRep_Builder builder;
  if (region.loops.empty()) {
    face = BRepBuilderAPI_MakeFace(surface, Precision::Confusion()).Face();
  } else {
    builder.MakeFace(face, surface, Precision::Confusion());
    for (const std::vector<Use>& loop : region.loops) {
      TopoDS_Wire wire;
      builder.MakeWire(wire);
      for (const Use& use : loop)
        builder.Add(wire, edges[use.chain].Oriented(use.reversed == forward ? TopAbs_REVERSED : TopAbs_FORWARD));
      wire.Closed(true);
      builder.Add(face, wire);
    }
  }
  if (!forward) face.Reverse();
  return face;
}

double area_of(const TopoDS_Shape& shape) {
  GProp_GProps properties;
  BRepGProp::SurfaceProperties(shape, properties);
  return std::abs(properties.Mass());
}

// That of a plane's piece comes from its loops, for noise makes triangles larger than what they cover.
double expected_area(const Trims& trims, const Region& region) {
  if (!std::holds_alternative<Plane>(region.surface)) return region.area;
  Vec3 twice;
  for (const std::vector<Vec3>& loop : outline_of(trims, region).loops) twice += twice_vector_area(loop);
  return 0.5 * norm(twice);
}

std::string flaw_of(const TopoDS_Shape& face, const Trims& trims, const Region& region) {
  if (face.IsNull()) return "has no face";
  try {
    if (!BRepCheck_Analyzer(face).IsValid()) return "is not valid";
    const double area = area_of(face), expected = expected_area(trims, region);
    if (std::abs(area - expected) > kAreaTolerance * expected)
      return fmt::format("has the area {:.4g}, its region {:.4g}", area, expected);
  } catch (const Standard_Failure& failure) {
    return fmt::format("cannot be measured ({})", failure.GetMessageString());
  }
  return "";
}

// Curves in the parameters of the surfaces, seams, degenerate edges at poles, and tolerances that cover the gaps.
TopoDS_Shape healed(const TopoDS_Shape& shape, double tolerance, const Handle(ShapeBuild_ReShape) & context) {
  const Handle(ShapeFix_Shape) fixer = new ShapeFix_Shape(shape);
  fixer->SetContext(context);
  fixer->SetPrecision(Precision::Confusion());
  fixer->SetMaxTolerance(tolerance);
  fixer->Perform();
  return fixer->Shape();
}

bool is_closed(const TopoDS_Shape& shape) { return shape.ShapeType() == TopAbs_SHELL && BRep_Tool::IsClosed(shape); }

TopoDS_Shape as_solid(const TopoDS_Shape& shell) {
  TopoDS_Solid solid = BRepBuilderAPI_MakeSolid(TopoDS::Shell(shell)).Solid();
  BRepLib::OrientClosedSolid(solid);
  return solid;
}

// What is done about flaws.
struct Repair {
  std::vector<char> as_patch;    // regions whose quadric becomes a height field
  std::vector<char> along_mesh;  // chains that keep to the mesh's border
};

Shell attempt(const Trims& trims, double tolerance, const Repair& repair) {
  const std::vector<TopoDS_Edge> edges = make_edges(trims, tolerance, repair.along_mesh);
  Shell result;
  std::vector<TopoDS_Face> raw;
  BRep_Builder builder;
  TopoDS_Shell shell;
  builder.MakeShell(shell);
  for (std::size_t r = 0; r < trims.regions.size(); ++r) {
    raw.push_back(trimmed_face(trims, trims.regions[r], edges, repair.as_patch[r]));
    if (!raw.back().IsNull()) builder.Add(shell, raw.back());
  }
  const Handle(ShapeBuild_ReShape) context = new ShapeBuild_ReShape;
  result.shape = healed(shell, kLargestGap * trims.diagonal, context);
  BRepLib::SameParameter(result.shape, Precision::Confusion(), true);
  BRepLib::UpdateTolerances(result.shape);
  for (std::size_t r = 0; r < raw.size(); ++r) {
    result.faces.push_back(raw[r].IsNull() ? TopoDS_Shape() : context->Apply(raw[r]));
    result.flaws.push_back(flaw_of(result.faces.back(), trims, trims.regions[r]));
  }
  if (is_closed(result.shape)) result.shape = as_solid(result.shape);
  return result;
}

std::size_t sound_faces(const Shell& shell) {
  return static_cast<std::size_t>(
      std::count_if(shell.flaws.begin(), shell.flaws.end(), [](const std::string& flaw) { return flaw.empty(); }));
}

}  // namespace

// Quadrics whose faces are flawed become height fields first; then the borders of flawed faces keep to the mesh, for
// where surfaces touch along a band they hardly tell where they meet.
Shell build_shell(const Trims& trims, double tolerance) {
  Repair repair{std::vector<char>(trims.regions.size(), 0), std::vector<char>(trims.chains.size(), 0)};
  Shell best = attempt(trims, tolerance, repair);
  for (const bool edges_too : {false, true}) {
    if (sound_faces(best) == trims.regions.size()) break;
    Repair more = repair;
    for (std::size_t r = 0; r < trims.regions.size(); ++r) {
      if (best.flaws[r].empty()) continue;
      more.as_patch[r] |=
          trims.regions[r].has_outer && std::holds_alternative<GeneralQuadric>(trims.regions[r].surface);
      if (!edges_too) continue;
      for (const std::vector<Use>& loop : trims.regions[r].loops)
        for (const Use& use : loop) more.along_mesh[use.chain] = 1;
    }
    Shell shell = attempt(trims, tolerance, more);
    if (sound_faces(shell) <= sound_faces(best)) continue;
    best = std::move(shell);
    repair = std::move(more);
  }
  return best;
}

}  // namespace bisector::step
