#include "tests/cad/kinds/part_drawings.h"

#include <BRepAlgoAPI_Cut.hxx>
#include <BRepAlgoAPI_Fuse.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakePolygon.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepFilletAPI_MakeFillet.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCone.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakePrism.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRepPrimAPI_MakeWedge.hxx>
#include <BRep_Tool.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

namespace feeler::cad {
namespace {

using Shape = TopoDS_Shape;
using Points = std::vector<std::pair<double, double>>;
constexpr double kPi = std::numbers::pi;

Shape Box3(double x0, double x1, double y0, double y1, double z0, double z1) {
  return BRepPrimAPI_MakeBox(gp_Pnt(x0, y0, z0), gp_Pnt(x1, y1, z1)).Shape();
}
/// Centred on the z axis.
Shape Block(double x, double y, double z0, double z1) { return Box3(-x / 2, x / 2, -y / 2, y / 2, z0, z1); }
Shape Rod(double x, double y, double radius, double z0, double z1) {
  return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, y, z0), gp_Dir(0, 0, 1)), radius, z1 - z0).Shape();
}
Shape Cone(double radius0, double radius1, double z0, double z1) {
  return BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(0, 0, z0), gp_Dir(0, 0, 1)), radius0, radius1, z1 - z0).Shape();
}
Shape Prism(const Points& points, double z0, double z1) {
  BRepBuilderAPI_MakePolygon polygon;
  for (const auto& [x, y] : points) polygon.Add(gp_Pnt(x, y, z0));
  polygon.Close();
  return BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(polygon.Wire()).Face(), gp_Vec(0, 0, z1 - z0)).Shape();
}
Shape operator+(const Shape& a, const Shape& b) { return BRepAlgoAPI_Fuse(a, b).Shape(); }
Shape operator-(const Shape& a, const Shape& b) { return BRepAlgoAPI_Cut(a, b).Shape(); }
Shape Moved(const Shape& shape, double x, double y, double z) {
  gp_Trsf move;
  move.SetTranslation(gp_Vec(x, y, z));
  return BRepBuilderAPI_Transform(shape, move, true).Shape();
}
Shape Turned(const Shape& shape, const gp_Dir& axis, double degrees) {
  gp_Trsf turn;
  turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), axis), degrees * kPi / 180);
  return BRepBuilderAPI_Transform(shape, turn, true).Shape();
}

/// A rectangle that widens upwards by as much as it is high: what a chamfer of 45 degrees takes away.
Shape Flare(double x0, double x1, double y0, double y1, double z0, double z1) {
  const double h = z1 - z0;
  // The wedge stands along y: its axes are turned onto z.
  return BRepPrimAPI_MakeWedge(gp_Ax2(gp_Pnt(x0 - h, y1 + h, z1), gp_Dir(0, 1, 0), gp_Dir(1, 0, 0)), x1 - x0 + 2 * h, h,
                               y1 - y0 + 2 * h, h, h, h + x1 - x0, h + y1 - y0)
      .Shape();
}

/// A regular polygon by the distance of its sides.
Points Regular(int sides, double across_flats) {
  Points points;
  const double radius = across_flats / 2 / std::cos(kPi / sides);
  for (int k = 0; k < sides; ++k)
    points.emplace_back(radius * std::cos(2 * kPi * (k + 0.5) / sides), radius * std::sin(2 * kPi * (k + 0.5) / sides));
  return points;
}

PartPair Keyed(double looser) {
  const double c = 0.15 * looser;
  return {
      Block(20, 10, 0, 50) + Box3(-1.5, 1.5, 4, 6.5, 0, 20),
      Block(40, 32, -20, 0) - (Block(20 + 2 * c, 10 + 2 * c, -12, 1) + Box3(-1.5 - c, 1.5 + c, 4, 6.5 + c, -12, 1))};
}

PartPair DPlug(double looser) {
  const double c = 0.12 * looser;
  return {Rod(0, 0, 6, 0, 50) - Box3(4, 10, -10, 10, -1, 60),
          Block(30, 30, -16, 0) - (Rod(0, 0, 6 + c, -10, 1) - Box3(4 + c, 10, -10, 10, -11, 2))};
}

PartPair UsbA() {
  // Shell of 12 x 4.5 mm, open at the tip; a plastic block fills its upper half.
  const Shape tool =
      (Block(12, 4.5, 0, 12) - Block(11.4, 3.9, -1, 12)) + Box3(-5.7, 5.7, 0.1, 1.95, 0.5, 12) + Block(15.7, 8, 12, 52);
  // The port: a cavity with a tongue in its lower half.
  const Shape target = (Block(22, 14, -18, 0) - Block(12.4, 4.9, -12.5, 1)) + Box3(-5.4, 5.4, -1.65, -0.2, -12.5, -0.5);
  return {tool, target};
}

PartPair Rj45(double looser) {
  // The latch: a tongue along the plug's back, at an angle.
  const Points side{{4.0, 2}, {4.6, 2}, {7.0, 14}, {6.4, 15}, {4.0, 15}};
  Shape latch = Turned(Prism(side, -3.0, 3.0), gp_Dir(1, 0, 0), 90);  // (y of the profile is z)
  latch = Turned(latch, gp_Dir(0, 0, 1), 90);
  const Shape tool = Block(11.6, 8.2, 0, 21) + latch + Box3(-5.8, 5.8, -4.1, 4.1, 20, 55);
  const double c = 0.13 * looser;
  const Shape target = Block(18, 20, -16, 0) - (Box3(-5.8 - c, 5.8 + c, -4.1 - c, 4.1 + c, -14, 1) +
                                                Box3(-3.0 - c, 3.0 + c, 4, 7.0 + c, -14, 1));
  return {tool, target};
}

PartPair TwoPin(double looser) {
  const double c = 0.2 * looser;
  return {Rod(-9.25, 0, 2, 0, 20) + Rod(9.25, 0, 2, 0, 20) + Block(34, 14, 19, 55),
          Block(46, 24, -25, 0) - (Rod(-9.25, 0, 2 + c, -19, 1) + Rod(9.25, 0, 2 + c, -19, 1))};
}

PartPair ThreePin(double looser) {
  const double c = 0.2 * looser;
  const auto pins = [](double grow, double z0, double z1, double earth) {
    return Box3(-11.1 - 3.2 - grow, -11.1 + 3.2 + grow, -2 - grow, 2 + grow, z0, z1) +
           Box3(11.1 - 3.2 - grow, 11.1 + 3.2 + grow, -2 - grow, 2 + grow, z0, z1) +
           Box3(-2 - grow, 2 + grow, 22.2 - 4 - grow, 22.2 + 4 + grow, earth, z1);
  };
  return {pins(0, 0, 19, -4) + Box3(-22, 22, -10, 34, 18, 55), Box3(-32, 32, -20, 44, -30, 0) - pins(c, -18, 1, -22)};
}

PartPair Gear() {
  Points teeth;
  const int count = 20;
  for (int k = 0; k < count; ++k) {
    for (const auto& [share, radius] : {std::pair{0.0, 13.0}, {0.22, 13.0}, {0.36, 15.6}, {0.6, 15.6}, {0.78, 13.0}}) {
      const double a = 2 * kPi * (k + share) / count;
      if (share == 0.0 && k > 0) continue;
      teeth.emplace_back(radius * std::cos(a), radius * std::sin(a));
    }
  }
  return {Prism(teeth, 0, 10) - Rod(0, 0, 4.1, -1, 11), Block(60, 60, -8, 0) + Rod(0, 0, 4, -1, 18)};
}

PartPair HexSocket() {
  return {Rod(0, 0, 8.5, 0, 60) - Prism(Regular(6, 10.2), -1, 8),
          Prism(Regular(6, 10.0), 0, 6.5) + Rod(0, 0, 3, -25, 0.5) + Block(40, 40, -30, -20)};
}

PartPair Taper() {
  return {Cone(6.0, 7.5, 0, 30) + Rod(0, 0, 7.5, 30, 60), Block(34, 34, -32, 0) - Cone(6.1, 7.6, -30, 0)};
}

/// The tool tapers on above the hole: the middles of the two cones are not alike.
PartPair LongTaper() {
  return {Cone(5.0, 6.5, 0, 30) + Rod(0, 0, 6.5, 30, 60), Block(34, 34, -25, 0) - Cone(5.05, 6.05, -20, 0)};
}

/// A shell that goes over a tongue which stands 1 mm below the rim: holes begin at two heights.
PartPair Shell() {
  const Shape tool = (Block(12, 4.5, 0, 12) - Box3(-5.6, 5.6, -0.3, 1.9, -1, 13)) + Block(14, 8, 11.9, 45);
  return {tool, (Block(24, 16, -20, 0) - Block(12.4, 4.9, -13, 1)) + Box3(-5.3, 5.3, -0.05, 1.65, -13.5, -1)};
}

/// A rectangular hole with a lead-in of 1 mm.
PartPair Chamfered(double looser) {
  const double c = 0.2 * looser;
  return {Block(10, 8, 0, 40),
          Block(40, 40, -20, 0) - (Block(10 + 2 * c, 8 + 2 * c, -12, 0) + Flare(-5 - c, 5 + c, -4 - c, 4 + c, -1, 0))};
}

/// The same of a hole that is not convex.
PartPair ChamferedTee(double looser) {
  const double c = 0.2 * looser;
  return {
      Box3(-8, 8, 2, 6, 0, 40) + Box3(-2, 2, -8, 3, 0, 40),
      Block(40, 40, -20, 0) - (Box3(-8 - c, 8 + c, 2 - c, 6 + c, -12, 0) + Box3(-2 - c, 2 + c, -8 - c, 3 + c, -12, 0) +
                               Flare(-8 - c, 8 + c, 2 - c, 6 + c, -1, 0) + Flare(-2 - c, 2 + c, -8 - c, 3 + c, -1, 0))};
}

PartPair Rectangle(double c) { return {Block(8, 7, 0, 50), Block(25, 25, 0, 9) - Block(8 + 2 * c, 7 + 2 * c, -1, 10)}; }

PartPair Tilted(double looser) {
  const PartPair upright = Rectangle(0.1 * looser);
  const gp_Dir axis(1, 2, 0.5);
  return {Turned(upright.tool, gp_Dir(0, 1, 0), 35), Moved(Turned(upright.target, axis, 20), 3, -5, 40)};
}

PartPair Assembled(double looser) {
  const PartPair keyed = Keyed(looser);
  return {Moved(keyed.tool, 30, 20, 5 - 12), Moved(keyed.target, 30, 20, 5)};
}

PartPair TwoMouths(double looser) {
  const double c = 0.1 * looser;
  return {Block(8, 7, 0, 50), Block(60, 25, -12, 0) - (Box3(-15 - 4 - c, -15 + 4 + c, -3.5 - c, 3.5 + c, -9, 1) +
                                                       Box3(15 - 4 - c, 15 + 4 + c, -3.5 - c, 3.5 + c, -9, 1))};
}

/// A round shaft with a key.
Shape KeyedRod(double grow, double z0, double z1) {
  return Rod(0, 0, 6 + grow, z0, z1) + Box3(4, 7.5 + grow, -1.5 - grow, 1.5 + grow, z0, z1);
}

PartPair KeyedShaft(double looser) {
  const double c = 0.1 * looser;
  return {KeyedRod(0, 0, 45), Block(30, 30, -16, 0) - KeyedRod(c, -12, 1)};
}

/// The key begins above the tip and ends below the head: the shaft's face goes all around above and below it.
PartPair ShortKey(double looser) {
  const double c = 0.1 * looser;
  return {Rod(0, 0, 6, 0, 45) + Box3(4, 7.5, -1.5, 1.5, 1.5, 28), Block(30, 30, -16, 0) - KeyedRod(c, -12, 1)};
}

/// A plug far longer than the plate is thick, and holes in the plate that are not for it.
PartPair ThinPlate(double looser) {
  const double c = 0.1 * looser;
  const Shape others =
      Rod(-40, 30, 6, -4, 1) + Rod(-45, -20, 20, -4, 1) + Rod(45, 25, 3, -4, 1) + Box3(15, 65, -40, 5, -4, 1);
  return {(Rod(0, 0, 4, 0, 12) - Box3(3.2, 9, -9, 9, -1, 11)) + Rod(0, 0, 7, 11, 20) + Rod(0, 0, 3, 19, 50),
          Block(150, 110, -3, 0) - others - (Rod(0, 0, 4 + c, -4, 1) - Box3(3.2 + c, 9, -9, 9, -5, 2))};
}

Shape Teeth(int count, double root, double tip, double z0, double z1) {
  Points points;
  for (int k = 0; k < count; ++k) {
    for (const auto& [share, radius] : {std::pair{0.0, root}, {0.3, root}, {0.4, tip}, {0.6, tip}, {0.7, root}}) {
      if (share == 0.0 && k > 0) continue;
      const double a = 2 * kPi * (k + share) / count;
      points.emplace_back(radius * std::cos(a), radius * std::sin(a));
    }
  }
  return Prism(points, z0, z1);
}

/// A gear with a keyway over a post with a key.
PartPair KeyedGear(double looser) {
  const double c = 0.1 * looser;
  return {Teeth(20, 13, 15.6, 0, 10) - KeyedRod(c, -1, 11), Block(60, 60, -8, 0) + KeyedRod(0, -1, 18)};
}

/// A hub over a shaft, with the hole of a set screw through one side of its bore.
PartPair SetScrew(double looser) {
  const Shape screw = Turned(Rod(0, 0, 1.6, 0, 20), gp_Dir(0, 1, 0), 90);
  return {Rod(0, 0, 12, 0, 14) - Rod(0, 0, 4 + 0.1 * looser, -1, 15) - Moved(screw, 0, 0, 7),
          Block(30, 30, -5, 0) + Rod(0, 0, 4, -1, 18)};
}

/// A pinion that goes into a ring with teeth inside.
PartPair RingGear(double looser) {
  const double c = 0.15 * looser;
  return {Teeth(12, 7, 9, 0, 40), Rod(0, 0, 18, -14, 0) - Teeth(12, 7 + c, 9 + c, -10, 1)};
}

PartPair Hexagon() { return {Prism(Regular(6, 10.0), 0, 45), Block(30, 26, -16, 0) - Prism(Regular(6, 10.2), -11, 1)}; }

/// Three round pins, each as every other.
PartPair RoundPins() {
  const auto pins = [](double grow, double z0, double z1) {
    return Rod(0, 0, 1.5 + grow, z0, z1) + Rod(11, 0, 1.5 + grow, z0, z1) + Rod(3, 8, 1.5 + grow, z0, z1);
  };
  return {pins(0, 0, 13) + Box3(-5, 16, -5, 13, 12, 50), Box3(-12, 24, -12, 20, -18, 0) - pins(0.15, -12, 1)};
}

Points Oval(double a, double b) {
  Points points;
  for (int k = 0; k < 90; ++k) points.emplace_back(a * std::cos(2 * kPi * k / 90), b * std::sin(2 * kPi * k / 90));
  return points;
}

/// No corner and no straight side.
PartPair Ellipse(double looser) {
  const double c = 0.15 * looser;
  return {Prism(Oval(7, 4.5), 0, 45), Block(30, 26, -15, 0) - Prism(Oval(7 + c, 4.5 + c), -10, 1)};
}

/// A hole whose axis leans against every face of its block.
PartPair Oblique(const Shape& peg, const Shape& hole) {
  Shape lean = Turned(Turned(hole, gp_Dir(0, 1, 0), 28), gp_Dir(0, 0, 1), 17);
  return {peg, Block(44, 40, -22, 0) - Moved(lean, 2, 1, -4)};
}

PartPair ObliqueBore() { return Oblique(Rod(0, 0, 4, 0, 50), Rod(0, 0, 4.1, -10, 20)); }
PartPair ObliqueSlot() { return Oblique(Block(9, 6, 0, 50), Block(9.3, 6.3, -10, 20)); }

/// A round peg with a hemisphere for a tip, into a bore.
PartPair Domed() {
  const Shape ball = BRepPrimAPI_MakeSphere(gp_Pnt(0, 0, 5), 5).Shape();
  return {Rod(0, 0, 5, 5, 50) + ball, Block(30, 30, -20, 0) - Rod(0, 0, 5.12, -15, 1)};
}

/// All edges for which `wanted` holds of their middle, rounded.
Shape Rounded(const Shape& shape, double radius, const std::function<bool(const gp_Pnt&)>& wanted) {
  BRepFilletAPI_MakeFillet fillet(shape);
  for (TopExp_Explorer edges(shape, TopAbs_EDGE); edges.More(); edges.Next()) {
    double from = 0;
    double to = 0;
    const TopoDS_Edge& edge = TopoDS::Edge(edges.Current());
    const Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, from, to);
    if (!curve.IsNull() && wanted(curve->Value(0.5 * (from + to)))) fillet.Add(radius, edge);
  }
  return fillet.Shape();
}

/// Edges of the peg and of the block, and the rim of the hole, are rounded.
PartPair Filleted(double looser) {
  const double c = 0.12 * looser;
  const Shape peg = Rounded(Block(10, 8, 0, 45), 0.8, [](const gp_Pnt&) { return true; });
  const Shape block = Rounded(Block(34, 30, -18, 0), 2.0, [](const gp_Pnt& p) { return p.Z() > -17; });
  const Shape hole = Rounded(Block(10 + 2 * c, 8 + 2 * c, -12, 5), 0.8,
                             [](const gp_Pnt& p) { return std::abs(p.X()) > 1 && std::abs(p.Y()) > 1; });
  return {peg, Rounded(block - hole, 1.0, [](const gp_Pnt& p) {
            return std::abs(p.Z()) < 1e-6 && std::abs(p.X()) < 8 && std::abs(p.Y()) < 7;
          })};
}

/// A bore with a rounded rim.
PartPair FilletedBore() {
  const Shape peg = Rounded(Rod(0, 0, 5, 0, 45), 1.0, [](const gp_Pnt& p) { return p.Z() < 1; });
  return {peg, Rounded(Block(30, 30, -18, 0) - Rod(0, 0, 5.1, -12, 1), 1.0,
                       [](const gp_Pnt& p) { return std::abs(p.Z()) < 1e-6 && std::hypot(p.X(), p.Y()) < 6; })};
}

/// A kind whose clearances are what they are.
std::function<PartPair(double)> AsDrawn(PartPair (*draw)()) {
  return [draw](double) { return draw(); };
}

}  // namespace

PartPair DrawParts(const std::string& kind, double looser) {
  static const std::vector<std::pair<std::string, std::function<PartPair(double)>>> kKinds = {
      {"keyed", Keyed},
      {"d-plug", DPlug},
      {"usb-a", AsDrawn(UsbA)},
      {"rj45", Rj45},
      {"two-pin", TwoPin},
      {"three-pin", ThreePin},
      {"gear", AsDrawn(Gear)},
      {"hex-socket", AsDrawn(HexSocket)},
      {"taper", AsDrawn(Taper)},
      {"long-taper", AsDrawn(LongTaper)},
      {"shell", AsDrawn(Shell)},
      {"chamfered", Chamfered},
      {"chamfered-tee", ChamferedTee},
      {"keyed-shaft", KeyedShaft},
      {"short-key", ShortKey},
      {"thin-plate", ThinPlate},
      {"keyed-gear", KeyedGear},
      {"set-screw", SetScrew},
      {"ring-gear", RingGear},
      {"hexagon", AsDrawn(Hexagon)},
      {"round-pins", AsDrawn(RoundPins)},
      {"ellipse", Ellipse},
      {"oblique-bore", AsDrawn(ObliqueBore)},
      {"oblique-slot", AsDrawn(ObliqueSlot)},
      {"domed", AsDrawn(Domed)},
      {"filleted", Filleted},
      {"filleted-bore", AsDrawn(FilletedBore)},
      {"exact", [](double) { return Rectangle(0); }},
      {"rectangle", [](double factor) { return Rectangle(0.1 * factor); }},
      {"tilted", Tilted},
      {"assembly", Assembled},
      {"two-mouths", TwoMouths},
      {"too-large", [](double) { return Rectangle(-0.13); }}};
  for (const auto& [name, draw] : kKinds) {
    if (name == kind) return draw(looser);
  }
  throw std::invalid_argument("no kind of parts is called " + kind);
}

}  // namespace feeler::cad
