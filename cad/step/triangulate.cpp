#include "feeler/cad/step/triangulate.h"

#include <BRepMesh_Context.hxx>
#include <BRepMesh_DefaultRangeSplitter.hxx>
#include <BRepMesh_DelaunayBaseMeshAlgo.hxx>
#include <BRepMesh_DelaunayNodeInsertionMeshAlgo.hxx>
#include <BRepMesh_FaceDiscret.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepMesh_MeshAlgoFactory.hxx>
#include <IMeshData_Edge.hxx>
#include <IMeshData_Face.hxx>
#include <IMeshData_PCurve.hxx>
#include <IMeshData_Wire.hxx>
#include <IMeshTools_MeshAlgo.hxx>
#include <IMeshTools_MeshAlgoFactory.hxx>
#include <IMeshTools_ModelAlgo.hxx>
#include <TopoDS_Shape.hxx>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace feeler::cad {
namespace {

/// Parameters of a surface that differ by less are one.
constexpr double kSame = 1e-6;

void Insert(std::vector<double>& values, double value, double gap) {
  if (std::none_of(values.begin(), values.end(), [&](double other) { return std::abs(other - value) < gap; }))
    values.push_back(value);
}

/// Where the edges of a face run that all go along its surface (one angle) or around it (one height).
struct EdgeGrid {
  std::vector<double> angles;                                   ///< of edges along
  std::vector<double> heights;                                  ///< of edges around
  std::vector<double> on_arcs;                                  ///< angles of the points on edges around
  double least_step = std::numeric_limits<double>::infinity();  ///< between those

  double lowest() const { return *std::min_element(heights.begin(), heights.end()); }
  double highest() const { return *std::max_element(heights.begin(), heights.end()); }
  /// A rectangle: no edge around but at its ends.
  bool IsPlain() const { return heights.size() <= 2; }

  void Add(const IMeshData::IPCurveHandle& curve, bool along) {
    if (along) return Insert(angles, curve->GetPoint(0).X(), kSame);
    Insert(heights, curve->GetPoint(0).Y(), kSame);
    for (int i = 0; i < curve->ParametersNb(); ++i) {
      on_arcs.push_back(curve->GetPoint(i).X());
      if (i > 0) least_step = std::min(least_step, std::abs(on_arcs.back() - on_arcs[on_arcs.size() - 2]));
    }
  }
};

/// Nothing where some edge slants.
std::optional<EdgeGrid> GridOf(const IMeshData::IFaceHandle& face) {
  EdgeGrid grid;
  for (int w = 0; w < face->WiresNb(); ++w) {
    const IMeshData::IWireHandle& wire = face->GetWire(w);
    for (int e = 0; e < wire->EdgesNb(); ++e) {
      const IMeshData::IPCurveHandle& curve = wire->GetEdge(e)->GetPCurve(face.get(), wire->GetEdgeOrientation(e));
      bool along = true;
      bool around = true;
      for (int i = 1; i < curve->ParametersNb(); ++i) {
        along = along && std::abs(curve->GetPoint(i).X() - curve->GetPoint(0).X()) < kSame;
        around = around && std::abs(curve->GetPoint(i).Y() - curve->GetPoint(0).Y()) < kSame;
      }
      if (!along && !around) return std::nullopt;
      if (along != around) grid.Add(curve, along);  // else a point, as of a cone
    }
  }
  return grid;
}

/// Points at the heights of the edges that end within a face (a key, a keyway, a flat that stops short): at one height
/// after the other, all around. Without them triangles from edge to edge would cut through the hollow.
class PointsAtEdges : public BRepMesh_DefaultRangeSplitter {
 public:
  Handle(IMeshData::ListOfPnt2d) GenerateSurfaceNodes(const IMeshTools_Parameters& /*parameters*/) const override {
    const Handle(NCollection_IncAllocator) memory = new NCollection_IncAllocator;
    Handle(IMeshData::ListOfPnt2d) nodes = new IMeshData::ListOfPnt2d(memory);
    const std::optional<EdgeGrid> grid = GridOf(GetDFace());
    if (!grid) return nodes;
    std::vector<double> angles = grid->angles;
    for (const double angle : grid->on_arcs) Insert(angles, angle, 0.5 * grid->least_step);
    for (const double height : grid->heights) {
      if (height == grid->lowest() || height == grid->highest()) continue;
      for (const double angle : angles) nodes->Append(gp_Pnt2d(angle, height));
    }
    return nodes;
  }
};

/// Straight lines run along planes, cylinders and cones from edge to edge: points within them add nothing to how near
/// they are met, and Open CASCADE's grid on a cone is a hundred slabs to cut (cad/section). That holds of faces whose
/// edges run along or around; where an edge is slanting (a bore that leans against its face), triangles from edge to
/// edge would cut through the hollow.
class FewPointsInside : public IMeshTools_MeshAlgo {
 public:
  void Perform(const IMeshData::IFaceHandle& face, const IMeshTools_Parameters& parameters,
               const Message_ProgressRange& range) override {
    const Handle(IMeshTools_MeshAlgo) algorithm = AlgorithmFor(face, parameters);
    if (!algorithm.IsNull()) algorithm->Perform(face, parameters, range);
  }

 private:
  static Handle(IMeshTools_MeshAlgo)
      AlgorithmFor(const IMeshData::IFaceHandle& face, const IMeshTools_Parameters& parameters) {
    const GeomAbs_SurfaceType type = face->GetSurface()->GetType();
    if (type == GeomAbs_Plane) return new BRepMesh_DelaunayBaseMeshAlgo;
    if (type == GeomAbs_Cylinder || type == GeomAbs_Cone) {
      const std::optional<EdgeGrid> grid = GridOf(face);
      if (grid && grid->IsPlain()) return new BRepMesh_DelaunayBaseMeshAlgo;
      if (grid) return new BRepMesh_DelaunayNodeInsertionMeshAlgo<PointsAtEdges, BRepMesh_DelaunayBaseMeshAlgo>;
    }
    return BRepMesh_MeshAlgoFactory().GetAlgo(type, parameters);
  }
};

class FewPointsInsideFactory : public IMeshTools_MeshAlgoFactory {
 public:
  Handle(IMeshTools_MeshAlgo)
      GetAlgo(const GeomAbs_SurfaceType /*type*/, const IMeshTools_Parameters& /*parameters*/) const override {
    return new FewPointsInside;
  }
};

/// In the place of what puts such points on the seams of cones, and looks for triangles that an earlier run has left.
class NoPointsOnSeams : public IMeshTools_ModelAlgo {
 protected:
  Standard_Boolean performInternal(const Handle(IMeshData_Model) & /*model*/,
                                   const IMeshTools_Parameters& /*parameters*/,
                                   const Message_ProgressRange& /*range*/) override {
    return true;
  }
};

}  // namespace

void Triangulate(const TopoDS_Shape& shape, double deflection_mm, double angle_rad) {
  const Handle(BRepMesh_Context) context = new BRepMesh_Context;
  context->SetPreProcessor(new NoPointsOnSeams);
  context->SetFaceDiscret(new BRepMesh_FaceDiscret(new FewPointsInsideFactory));
  BRepMesh_IncrementalMesh mesh;
  mesh.SetShape(shape);
  mesh.ChangeParameters().Deflection = deflection_mm;
  mesh.ChangeParameters().Angle = angle_rad;
  mesh.Perform(context);
}

}  // namespace feeler::cad
