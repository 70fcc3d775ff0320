#pragma once

class TopoDS_Shape;

namespace feeler::cad {

/// Gives every face its triangles: a surface is met within `deflection_mm`, an arc within `angle_rad`. Within planes,
/// and cylinders and cones whose edges run along and around, corners stand at the heights of the edges only.
void Triangulate(const TopoDS_Shape& shape, double deflection_mm, double angle_rad);

}  // namespace feeler::cad
