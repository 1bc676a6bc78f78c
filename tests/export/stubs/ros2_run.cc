// Drives the controller of one joint as the controller manager does: rows of q, dq and references.
#include <cmath>

#include "j1_controller.cpp"

extern "C" int run(int count, unsigned int rate, const double *rows, double *effort)
{
  using controller_interface::CallbackReturn;
  using controller_interface::return_type;
  corrected_joints::J1Controller controller;
  controller.update_rate = rate;
  if (controller.on_init() != CallbackReturn::SUCCESS) return 1;
  if (controller.on_configure({}) != CallbackReturn::SUCCESS) return 2;
  if (controller.command_interface_configuration().names != std::vector<std::string>{"j1/effort"})
    return 3;
  if (controller.state_interface_configuration().names !=
      std::vector<std::string>{"j1/position", "j1/velocity"})
    return 4;
  auto references = controller.export_reference_interfaces();
  if (references.size() != 2 || references[0].name != "front/j1/effort") return 5;
  if (references[1].name != "front/j1/tau_other") return 13;
  if (!controller.set_chained_mode(true)) return 6;
  controller.command_interfaces_.resize(1);
  controller.state_interfaces_.resize(2);
  for (int pass = 0; pass < 2; pass++)  // active again, it begins again
  {
    if (controller.on_activate({}) != CallbackReturn::SUCCESS) return 7;
    if (!std::isnan(*references[0].value)) return 8;
    for (int i = 0; i < count; i++)
    {
      controller.state_interfaces_[0].held = rows[4 * i];
      controller.state_interfaces_[1].held = rows[4 * i + 1];
      *references[0].value = rows[4 * i + 2];
      *references[1].value = rows[4 * i + 3];
      if (controller.update({}, {}) != return_type::OK) return 9;
      effort[i] = controller.command_interfaces_[0].held;
    }
    if (controller.on_deactivate({}) != CallbackReturn::SUCCESS) return 10;
    if (controller.command_interfaces_[0].held != 0.0) return 11;
  }
  controller.state_interfaces_[1].held.reset();
  return controller.update({}, {}) == return_type::ERROR ? 0 : 12;
}
