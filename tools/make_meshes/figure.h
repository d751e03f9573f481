// The figure: a swan with raised wings on a round plinth of rippled water.
#pragma once

#include "shapes.h"

namespace make_meshes {

class Figure {
 public:
  Figure();
  double distance(dvec3 p) const;  // negative inside; millimetres, y up, standing on y = 0
  double detail(dvec3 p) const;    // what triangles may measure there, 1 being the rest: the head has finer ones

 private:
  struct Wing {
    Tube arm;
    std::vector<Feather> feathers;
    dvec3 centre{0.0};
    double radius = 0.0;
    double distance(dvec3 p) const;
    void enclose(dvec3 middle);  // makes a sphere around it that holds all feathers
  };
  static Wing make_wing(double side, double lift, double sweep);
  void make_tail();
  double body(dvec3 p) const;
  double head(dvec3 p) const;
  double plinth(dvec3 p) const;

  Tube neck_;
  Frame head_;
  std::vector<Wing> wings_;
  std::vector<Feather> tail_;
};

}  // namespace make_meshes
