// Times Pinocchio's algorithms on one state at a time. Header-only on purpose: linking the wheel's libraries would mix
// two alignments of Eigen's types.
//
//   driver MODEL STATES   (both written by run.py)
//
// Prints one line an algorithm: name, nanoseconds a call (median of the repeats), and a sum of all its results.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include <pinocchio/multibody/joint.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/regressor.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

using pinocchio::Data;
using pinocchio::Model;

static Model read_model(const char *path)
{
  std::ifstream in(path);
  int joints;
  in >> joints;
  Model model;
  for (int i = 0; i < joints; ++i)
  {
    std::string type;
    int parent;
    Eigen::Matrix3d rotation, inertia;
    Eigen::Vector3d translation, lever;
    double mass;
    in >> type >> parent;
    for (int k = 0; k < 9; ++k)
      in >> rotation(k / 3, k % 3);
    in >> translation.x() >> translation.y() >> translation.z() >> mass >> lever.x() >> lever.y() >> lever.z();
    for (int k = 0; k < 9; ++k)
      in >> inertia(k / 3, k % 3);
    const pinocchio::SE3 placement(rotation, translation);
    const std::string name = "joint" + std::to_string(i);
    pinocchio::JointIndex index = 0;
    if (type == "JointModelRX")
      index = model.addJoint(parent, pinocchio::JointModelRX(), placement, name);
    else if (type == "JointModelRY")
      index = model.addJoint(parent, pinocchio::JointModelRY(), placement, name);
    else if (type == "JointModelRZ")
      index = model.addJoint(parent, pinocchio::JointModelRZ(), placement, name);
    else
    {
      std::cerr << "joint type " << type << " is not one that this driver knows: RX, RY or RZ\n";
      std::exit(1);
    }
    model.appendBodyToJoint(index, pinocchio::Inertia(mass, lever, inertia), pinocchio::SE3::Identity());
  }
  return model;
}

// Median nanoseconds of one call, over short repeats (a busy machine spoils few of them) of `rounds` passes through all states.
template<typename Call>
static double time_calls(std::size_t states, Call call)
{
  const int repeats = 101;
  const std::size_t rounds = std::max<std::size_t>(1, 2000 / states);
  std::vector<double> times;
  for (int r = 0; r < repeats; ++r)
  {
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t k = 0; k < rounds; ++k)
      for (std::size_t s = 0; s < states; ++s)
        call(s);
    const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - start;
    times.push_back(took.count() / double(rounds * states));
  }
  std::nth_element(times.begin(), times.begin() + repeats / 2, times.end());
  return times[repeats / 2];
}

int main(int argc, char **argv)
{
  if (argc != 3)
  {
    std::cerr << "usage: driver MODEL STATES\n";
    return 1;
  }
  const Model model = read_model(argv[1]);
  Data data(model);
  std::ifstream in(argv[2]);
  std::size_t states;
  in >> states;
  std::vector<Eigen::VectorXd> q(states), v(states), a(states), tau(states);
  for (std::size_t s = 0; s < states; ++s)
    for (auto *part : {&q[s], &v[s], &a[s], &tau[s]})
    {
      part->resize(model.nv);
      for (int i = 0; i < model.nv; ++i)
        in >> (*part)[i];
    }

  double sum = 0.0;
  for (std::size_t s = 0; s < states; ++s)
    sum += pinocchio::rnea(model, data, q[s], v[s], a[s]).sum();
  std::printf("inverse_dynamics %.3f %.17g\n",
              time_calls(states, [&](std::size_t s) { pinocchio::rnea(model, data, q[s], v[s], a[s]); }), sum);

  sum = 0.0;
  for (std::size_t s = 0; s < states; ++s)
    sum += pinocchio::aba(model, data, q[s], v[s], tau[s], pinocchio::Convention::LOCAL).sum();
  std::printf("forward_dynamics %.3f %.17g\n", time_calls(states, [&](std::size_t s) {
                pinocchio::aba(model, data, q[s], v[s], tau[s], pinocchio::Convention::LOCAL);
              }), sum);
  std::printf("forward_dynamics_world %.3f %.17g\n", time_calls(states, [&](std::size_t s) {
                pinocchio::aba(model, data, q[s], v[s], tau[s], pinocchio::Convention::WORLD);
              }), sum);

  sum = 0.0;
  for (std::size_t s = 0; s < states; ++s)
  {
    data.M.setZero();
    const auto &mass = pinocchio::crba(model, data, q[s], pinocchio::Convention::LOCAL);
    sum += mass.triangularView<Eigen::Upper>().toDenseMatrix().sum();
  }
  std::printf("mass_matrix %.3f %.17g\n",
              time_calls(states, [&](std::size_t s) { pinocchio::crba(model, data, q[s], pinocchio::Convention::LOCAL); }),
              sum);
  std::printf("mass_matrix_world %.3f %.17g\n",
              time_calls(states, [&](std::size_t s) { pinocchio::crba(model, data, q[s], pinocchio::Convention::WORLD); }),
              sum);

  sum = 0.0;
  for (std::size_t s = 0; s < states; ++s)
    sum += pinocchio::computeJointTorqueRegressor(model, data, q[s], v[s], a[s]).sum();
  std::printf("regressor %.3f %.17g\n", time_calls(states, [&](std::size_t s) {
                pinocchio::computeJointTorqueRegressor(model, data, q[s], v[s], a[s]);
              }), sum);
  return 0;
}
