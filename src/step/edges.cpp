#include "step/edges.h"

#include <BRep_Builder.hxx>
#include <Eigen/Eigenvalues>
#include <ElCLib.hxx>
#include <GC_MakeArcOfCircle.hxx>
#include <GeomAPI_PointsToBSpline.hxx>
#include <GeomAPI_ProjectPointOnCurve.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_Circle.hxx>
#include <Geom_Line.hxx>
#include <Geom_TrimmedCurve.hxx>
#include <Standard_Failure.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array1OfPnt.hxx>
#include <TopoDS_Vertex.hxx>
#include <algorithm>
#include <cmath>
#include <gp_Circ.hxx>
#include <map>
#include <numbers>
#include <optional>
#include <set>

#include "segment/meeting_point.h"
#include "step/convert.h"

namespace bisector::step {
namespace {

constexpr int kSamples = 32;         // of a curve, to see whether it is on the surfaces, at least
constexpr double kTolerance = 1e-5;  // of the diagonal, for surfaces that are exact

struct Curve {
  Handle(Geom_Curve) geometry;
  double first = 0, last = 0;
};

class EdgeMaker {
 public:
  EdgeMaker(const Trims& trims, double tolerance) : trims_(trims), tolerance_(tolerance) { place_ends(); }

  TopoDS_Edge make(const Chain& chain, bool along_mesh) {
    along_mesh_ = along_mesh;
    const std::vector<Vec3> points = placed(chain);
    const Curve curve = curve_through(points, chain);
    BRep_Builder builder;
    TopoDS_Edge edge;
    builder.MakeEdge(edge, curve.geometry, Precision::Confusion());
    builder.Add(edge, vertex_at(chain.vertices.front(), points.front(), curve, curve.first).Oriented(TopAbs_FORWARD));
    builder.Add(
        edge, vertex_at(chain.closed ? chain.vertices.front() : chain.vertices.back(), points.back(), curve, curve.last)
                  .Oriented(TopAbs_REVERSED));
    builder.Range(edge, curve.first, curve.last);
    return edge;
  }

 private:
  static double spread_of(const Chain& chain) {
    double length = 0;
    for (std::size_t i = 1; i < chain.points.size(); ++i) length += norm(chain.points[i] - chain.points[i - 1]);
    return length / static_cast<double>(chain.points.size() - 1);
  }

  Vec3 meet(const Vec3& p, const std::set<Index>& regions, double spread) const {
    if (along_mesh_) return p;
    std::vector<MeetingSurface> surfaces;
    for (const Index r : regions) surfaces.push_back({&trims_.regions[r].surface, trims_.regions[r].rms});
    return meeting_point(p, surfaces, spread);
  }

  // Where chains end, all surfaces beside them meet.
  void place_ends() {
    struct End {
      Vec3 point;
      std::set<Index> regions;
      double spread = 0;
    };
    std::map<Index, End> ends;
    for (const Chain& chain : trims_.chains) {
      if (chain.closed) continue;
      for (const bool at_start : {true, false}) {
        End& end = ends[at_start ? chain.vertices.front() : chain.vertices.back()];
        end.point = at_start ? chain.points.front() : chain.points.back();
        end.regions.insert(chain.regions.begin(), chain.regions.end());
        end.spread = std::max(end.spread, spread_of(chain));
      }
    }
    for (const auto& [vertex, end] : ends) ends_[vertex] = meet(end.point, end.regions, end.spread);
  }

  // A closed chain's first point comes again.
  std::vector<Vec3> placed(const Chain& chain) const {
    const std::set<Index> regions(chain.regions.begin(), chain.regions.end());
    const double spread = spread_of(chain);
    std::vector<Vec3> points;
    for (const Vec3& p : chain.points) points.push_back(meet(p, regions, spread));
    if (chain.closed) {
      points.push_back(points.front());
    } else {
      points.front() = ends_.at(chain.vertices.front());
      points.back() = ends_.at(chain.vertices.back());
    }
    return points;
  }

  // How far a curve may be off the surfaces beside it.
  double tolerance_of(const Chain& chain) const {
    if (tolerance_ > 0) return tolerance_;
    double tolerance = kTolerance * trims_.diagonal;
    for (const Index r : chain.regions) tolerance = std::max(tolerance, trims_.regions[r].rms);
    return tolerance;
  }

  Curve curve_through(const std::vector<Vec3>& points, const Chain& chain) {
    // Where more than two surfaces meet, they need not do so in one point.
    double gap = 0;
    for (std::size_t i = 0; i < points.size(); i += along_mesh_ ? 1 : points.size() - 1)
      for (const Index r : chain.regions) gap = std::max(gap, distance(trims_.regions[r].surface, points[i]));
    surface_tolerance_ = tolerance_of(chain) + gap;
    // Between two surfaces these tell where the curve runs, and where they do not, the mesh knows it up to an edge.
    point_tolerance_ = chain.regions.size() == 2 ? std::max(surface_tolerance_, spread_of(chain)) : surface_tolerance_;
    if (const std::optional<Curve> line = as_line(points, chain)) return *line;
    if (const std::optional<Curve> circle = chain.closed ? as_circle(points) : as_arc(points))
      if (is_on_surfaces(*circle, chain)) return *circle;
    const std::vector<Vec3> smoothed = smooth(points, chain);
    if (const std::optional<Curve> spline = as_spline(smoothed, 0.5 * surface_tolerance_))
      if (is_on_surfaces(*spline, chain)) return *spline;
    return as_polyline(smoothed);
  }

  // Points of a smooth curve near these, closer together, where the surfaces meet. The ends stay.
  std::vector<Vec3> smooth(const std::vector<Vec3>& points, const Chain& chain) const {
    std::vector<Vec3> dense;
    const std::size_t n = points.size() - 1, pieces = 1 + kSamples / n;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < pieces; ++k)
        dense.push_back(points[i] +
                        (static_cast<double>(k) / static_cast<double>(pieces)) * (points[i + 1] - points[i]));
    dense.push_back(points.back());
    const std::set<Index> regions(chain.regions.begin(), chain.regions.end());
    const double spread = spread_of(chain);
    if (const std::optional<Curve> curve = as_spline(dense, point_tolerance_)) {
      const std::size_t count = dense.size() - 1;
      for (std::size_t k = 1; k < count; ++k)
        dense[k] = vector(curve->geometry->Value(curve->first + static_cast<double>(k) / static_cast<double>(count) *
                                                                    (curve->last - curve->first)));
    }
    // The ends may be off both surfaces; the way there is spread over all points.
    const Vec3 at_start = dense.front() - meet(dense.front(), regions, spread);
    const Vec3 at_end = dense.back() - meet(dense.back(), regions, spread);
    for (std::size_t k = 1; k + 1 < dense.size(); ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(dense.size() - 1);
      dense[k] = meet(dense[k], regions, spread) + (1 - share) * at_start + share * at_end;
    }
    return dense;
  }

  bool is_near(const Handle(Geom_Curve) & curve, const std::vector<Vec3>& points) const {
    return std::all_of(points.begin(), points.end(), [&](const Vec3& p) {
      const GeomAPI_ProjectPointOnCurve foot(point(p), curve);
      const double ends = std::min(curve->Value(curve->FirstParameter()).Distance(point(p)),
                                   curve->Value(curve->LastParameter()).Distance(point(p)));
      return std::min(ends, foot.NbPoints() > 0 ? foot.LowerDistance() : ends) <= point_tolerance_;
    });
  }

  bool is_on_surfaces(const Curve& curve, const Chain& chain) const {
    const auto samples = static_cast<int>(kSamples + 4 * chain.points.size());
    for (int k = 0; k <= samples; ++k) {
      const Vec3 p = vector(curve.geometry->Value(curve.first + k * (curve.last - curve.first) / samples));
      for (const Index r : chain.regions)
        if (distance(trims_.regions[r].surface, p) > surface_tolerance_) return false;
    }
    return true;
  }

  std::optional<Curve> as_line(const std::vector<Vec3>& points, const Chain& chain) const {
    const Vec3 &a = points.front(), &b = points.back();
    const double length = norm(b - a);
    if (chain.closed || !(length > Precision::Confusion())) return {};
    for (const Vec3& p : points)
      if (norm(p - nearest_on_segment(p, a, b)) > point_tolerance_) return {};
    const Curve line{new Geom_Line(point(a), gp_Dir(gp_Vec(point(a), point(b)))), 0, length};
    if (!is_on_surfaces(line, chain)) return {};
    return line;
  }

  std::optional<Curve> as_arc(const std::vector<Vec3>& points) const {
    if (points.size() < 4) return {};
    try {
      const GC_MakeArcOfCircle made(point(points.front()), point(points[points.size() / 2]), point(points.back()));
      if (!made.IsDone()) return {};
      const Handle(Geom_TrimmedCurve) arc = made.Value();
      if (!is_near(arc, points)) return {};
      return Curve{arc->BasisCurve(), arc->FirstParameter(), arc->LastParameter()};
    } catch (const Standard_Failure&) {
      return {};
    }
  }

  // By least squares: their plane, then the circle in it (Kasa 1976).
  std::optional<Curve> as_circle(const std::vector<Vec3>& points) const {
    const auto n = static_cast<double>(points.size() - 1);
    if (n < 4) return {};
    Vec3 centre;
    for (std::size_t i = 1; i < points.size(); ++i) centre += (1 / n) * points[i];
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Vec3 v = points[i] - centre;
      const Eigen::Vector3d d(v.x, v.y, v.z);
      spread += d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
    const auto axis = [&](int k) {
      const Eigen::Vector3d e = solver.eigenvectors().col(k);
      return Vec3{e.x(), e.y(), e.z()};
    };
    const Vec3 u = axis(2), v = axis(1);
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    double turned = 0;
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Vec3 p = points[i] - centre, before = points[i - 1] - centre;
      const double x = dot(p, u), y = dot(p, v);
      const Eigen::Vector3d row(x, y, 1);
      a += row * row.transpose();
      b += row * (x * x + y * y);
      turned += dot(before, u) * y - dot(before, v) * x;
    }
    const Eigen::Vector3d solution = a.ldlt().solve(b);
    const double square = solution.z() + 0.25 * (solution.x() * solution.x() + solution.y() * solution.y());
    if (!(square > 0)) return {};
    const Vec3 middle = centre + 0.5 * (solution.x() * u + solution.y() * v);
    Vec3 normal = cross(u, v);
    if (turned < 0) normal = -normal;
    const Vec3 start = points[0] - middle, x = unit(start - dot(start, normal) * normal);
    if (norm2(x) == 0) return {};
    const gp_Ax2 axes(point(middle), direction(normal), direction(x));
    const Handle(Geom_Curve) circle = new Geom_Circle(axes, std::sqrt(square));
    if (!is_near(circle, points)) return {};
    return Curve{circle, 0, 2 * std::numbers::pi};
  }

  std::optional<Curve> as_spline(const std::vector<Vec3>& points, double tolerance) const {
    TColgp_Array1OfPnt array(1, static_cast<int>(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) array(static_cast<int>(i) + 1) = point(points[i]);
    try {
      const GeomAPI_PointsToBSpline made(array, 3, 5, GeomAbs_C2, tolerance);
      if (!made.IsDone()) return {};
      const Handle(Geom_Curve) curve(made.Curve());
      if (!is_near(curve, points)) return {};
      return Curve{curve, curve->FirstParameter(), curve->LastParameter()};
    } catch (const Standard_Failure&) {
      return {};
    }
  }

  static Curve as_polyline(const std::vector<Vec3>& given) {
    std::vector<Vec3> points{given.front()};
    for (const Vec3& p : given)
      if (norm(p - points.back()) > Precision::Confusion()) points.push_back(p);
    if (points.size() == 1) points.push_back(given.back());
    const int n = static_cast<int>(points.size());
    TColgp_Array1OfPnt poles(1, n);
    TColStd_Array1OfReal knots(1, n);
    TColStd_Array1OfInteger multiplicities(1, n);
    multiplicities.Init(1);
    multiplicities(1) = multiplicities(n) = 2;
    double length = 0;
    for (int i = 1; i <= n; ++i) {
      const auto k = static_cast<std::size_t>(i) - 1;
      if (i > 1) length += std::max(norm(points[k] - points[k - 1]), Precision::Confusion());
      poles(i) = point(points[k]);
      knots(i) = length;
    }
    return {new Geom_BSplineCurve(poles, knots, multiplicities, 1), 0, length};
  }

  // The vertex of a mesh's vertex, large enough for the end of this curve.
  TopoDS_Vertex vertex_at(Index index, const Vec3& p, const Curve& curve, double parameter) {
    BRep_Builder builder;
    TopoDS_Vertex& vertex = vertices_[index];
    if (vertex.IsNull()) builder.MakeVertex(vertex, point(p), Precision::Confusion());
    const double gap = BRep_Tool::Pnt(vertex).Distance(curve.geometry->Value(parameter));
    builder.UpdateVertex(vertex, gap + Precision::Confusion());
    return vertex;
  }

  const Trims& trims_;
  const double tolerance_;  // 0: as the regions' distances demand
  // Of the chain at hand.
  bool along_mesh_ = false;
  double surface_tolerance_ = 0, point_tolerance_ = 0;
  std::map<Index, Vec3> ends_;
  std::map<Index, TopoDS_Vertex> vertices_;
};

}  // namespace

std::vector<TopoDS_Edge> make_edges(const Trims& trims, double tolerance, const std::vector<char>& along_mesh) {
  EdgeMaker maker(trims, tolerance);
  std::vector<TopoDS_Edge> edges;
  for (std::size_t k = 0; k < trims.chains.size(); ++k) edges.push_back(maker.make(trims.chains[k], along_mesh[k]));
  return edges;
}

}  // namespace bisector::step
