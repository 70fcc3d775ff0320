#include "feeler/cad/step/read_step.h"

#include <fmt/format.h>

#include <BRep_Tool.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Poly_Triangulation.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp_Explorer.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <TransferBRep.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <string>
#include <utility>

#include "feeler/cad/readers/read_apart.h"
#include "feeler/cad/step/triangulate.h"

namespace feeler::cad {
namespace {

/// The triangles of the faces of a solid; faces are turned as the solid has them.
TriangleMesh MeshOf(const TopoDS_Shape& solid) {
  TriangleMesh mesh;
  for (TopExp_Explorer faces(solid, TopAbs_FACE); faces.More(); faces.Next()) {
    const TopoDS_Face& face = TopoDS::Face(faces.Current());
    TopLoc_Location location;
    const Handle(Poly_Triangulation) triangulation = BRep_Tool::Triangulation(face, location);
    if (triangulation.IsNull()) continue;
    const int offset = static_cast<int>(mesh.points.size());
    for (int i = 1; i <= triangulation->NbNodes(); ++i) {
      const gp_Pnt p = triangulation->Node(i).Transformed(location.Transformation());
      mesh.points.emplace_back(p.X(), p.Y(), p.Z());
    }
    for (int i = 1; i <= triangulation->NbTriangles(); ++i) {
      int a = 0;
      int b = 0;
      int c = 0;
      triangulation->Triangle(i).Get(a, b, c);
      if (face.Orientation() == TopAbs_REVERSED) std::swap(b, c);
      mesh.triangles.push_back({offset + a - 1, offset + b - 1, offset + c - 1});
    }
  }
  return mesh;
}

/// The name that the file gives the solid; empty where it gives none.
std::string NameOf(STEPControl_Reader& reader, const TopoDS_Shape& solid) {
  const Handle(Standard_Transient) entity = reader.WS()->TransferReader()->EntityFromShapeResult(solid, 1);
  const Handle(StepRepr_RepresentationItem) item = Handle(StepRepr_RepresentationItem)::DownCast(entity);
  if (item.IsNull() || item->Name().IsNull()) return "";
  return item->Name()->ToCString();
}

RawPart ReadHere(const std::filesystem::path& file, double deflection_mm, double angle_rad) {
  try {
    Message::DefaultMessenger()->ChangePrinters().Clear();  // it writes to stdout
    STEPControl_Reader reader;
    if (reader.ReadFile(file.c_str()) != IFSelect_RetDone) {
      throw Refusal{"is not a STEP file that Open CASCADE can read", "export it as AP214 or AP242"};
    }
    reader.TransferRoots();
    const TopoDS_Shape shape = reader.OneShape();
    if (shape.IsNull()) throw Refusal{"holds no shape", "export a solid"};
    Triangulate(shape, deflection_mm, angle_rad);
    RawPart part{"STEP", {}, ParseUnit("mm"), true, {}};  // the reader converts
    for (TopExp_Explorer solids(shape, TopAbs_SOLID); solids.More(); solids.Next()) {
      RawBody body{NameOf(reader, solids.Current()), MeshOf(solids.Current()), {}};
      if (body.name.empty()) body.name = fmt::format("solid {}", part.bodies.size() + 1);
      part.bodies.push_back(std::move(body));
    }
    if (part.bodies.empty()) throw Refusal{"holds surfaces but no solid", "sew them to a solid in your CAD program"};
    return part;
  } catch (const Standard_Failure& failure) {
    throw Refusal{fmt::format("Open CASCADE fails: {}", failure.GetMessageString()), "export it again, or as STL"};
  }
}

}  // namespace

RawPart ReadStep(const std::filesystem::path& file, double deflection_mm, double angle_rad) {
  return ReadApart(file, "Open CASCADE", [&] { return ReadHere(file, deflection_mm, angle_rad); });
}

}  // namespace feeler::cad
