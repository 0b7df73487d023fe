// An L-shaped plate with a bolt hole: gmsh -2 -format msh41 bracket.geo
R = 5; fine = 0.6; coarse = 4;
Point(1) = {0, 0, 0, coarse};    Point(2) = {70, 0, 0, coarse};  Point(3) = {70, 12, 0, coarse};
Point(4) = {24, 12, 0, 2};       Point(5) = {18, 18, 0, 2};      Point(6) = {18, 60, 0, coarse};
Point(7) = {0, 60, 0, coarse};   Point(8) = {24, 18, 0, 2};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Circle(4) = {4, 8, 5};
Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 1};
Point(10) = {9, 48, 0, fine};    Point(11) = {9 + R, 48, 0, fine}; Point(12) = {9, 48 + R, 0, fine};
Point(13) = {9 - R, 48, 0, fine}; Point(14) = {9, 48 - R, 0, fine};
Circle(11) = {11, 10, 12}; Circle(12) = {12, 10, 13}; Circle(13) = {13, 10, 14}; Circle(14) = {14, 10, 11};
Curve Loop(1) = {1, 2, 3, 4, 5, 6, 7}; Curve Loop(2) = {11, 12, 13, 14};
Plane Surface(1) = {1, 2};
Physical Surface("plate") = {1}; Physical Curve("hole") = {11, 12, 13, 14};
Physical Curve("back") = {7}; Physical Curve("tip") = {2}; Physical Curve("arm") = {3};
