#pragma once

#include <TopoDS_Shape.hxx>
#include <string>

namespace feeler::cad {

/// Two parts that go together, as solids; millimetres.
struct PartPair {
  TopoDS_Shape tool;
  TopoDS_Shape target;
};

/// Draws a kind (PartKinds names them). `looser`: a factor of the clearances of the kinds whose clearance is one number
/// (PartKind::scalable_clearance). Throws std::invalid_argument for a name that is none.
PartPair DrawParts(const std::string& kind, double looser);

}  // namespace feeler::cad
