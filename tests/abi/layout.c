/* Layout of the structs that cross the plugin boundary and of the rows of lists, against the stored table
 * plugin_layout.csv (LP64). A row that differs means that plugins and programs built yesterday misread today's
 * library: put the member at the end of its struct, or raise the ABI and write the table anew.
 *
 * layout TABLE           compares; exit 1 and the rows that differ
 * layout --write TABLE   writes the table */
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "deform/deform.h"

typedef struct { const char *type, *member; size_t value; } Row;
#define S(T) {#T, "sizeof", sizeof(T)}
#define M(T, m) {#T, #m, offsetof(T, m)}

static const Row rows[] = {
  S(dfm_host),
  M(dfm_host, size), M(dfm_host, abi), M(dfm_host, abi_draft), M(dfm_host, reserved), M(dfm_host, ctx), M(dfm_host, alloc),
  M(dfm_host, release), M(dfm_host, scratch), M(dfm_host, log), M(dfm_host, parallel_for), M(dfm_host, extension),
  S(dfm_param),
  M(dfm_param, key), M(dfm_param, label), M(dfm_param, unit), M(dfm_param, min), M(dfm_param, max), M(dfm_param, def),
  M(dfm_param, flags), M(dfm_param, width), M(dfm_param, names),
  S(dfm_slot),
  M(dfm_slot, unit), M(dfm_slot, width), M(dfm_slot, kind), M(dfm_slot, reserved),
  S(dfm_type),
  M(dfm_type, size), M(dfm_type, kind), M(dfm_type, id), M(dfm_type, name), M(dfm_type, version), M(dfm_type, licence),
  M(dfm_type, source), M(dfm_type, params), M(dfm_type, nparam), M(dfm_type, param_size), M(dfm_type, effects), M(dfm_type, ops),
  S(dfm_friction_in),
  M(dfm_friction_in, size), M(dfm_friction_in, n), M(dfm_friction_in, stride), M(dfm_friction_in, flags), M(dfm_friction_in, dt),
  M(dfm_friction_in, params), M(dfm_friction_in, data), M(dfm_friction_in, fn), M(dfm_friction_in, vt),
  M(dfm_friction_in, ft_stop), M(dfm_friction_in, area), M(dfm_friction_in, dwell), M(dfm_friction_in, state),
  S(dfm_friction_out),
  M(dfm_friction_out, size), M(dfm_friction_out, flags), M(dfm_friction_out, ft), M(dfm_friction_out, state),
  M(dfm_friction_out, dft_dvt), M(dfm_friction_out, dft_dfn), M(dfm_friction_out, limit), M(dfm_friction_out, mode),
  M(dfm_friction_out, stored),
  S(dfm_friction),
  M(dfm_friction, size), M(dfm_friction, needs), M(dfm_friction, flags), M(dfm_friction, nslot), M(dfm_friction, slots),
  M(dfm_friction, eval), M(dfm_friction, check), M(dfm_friction, prepare), M(dfm_friction, release), M(dfm_friction, state),
  S(dfm_mesh),
  M(dfm_mesh, size), M(dfm_mesh, npoint), M(dfm_mesh, ncell), M(dfm_mesh, cell), M(dfm_mesh, rest), M(dfm_mesh, cells),
  M(dfm_mesh, mass), M(dfm_mesh, params), M(dfm_mesh, field_keys), M(dfm_mesh, fields), M(dfm_mesh, nedge), M(dfm_mesh, nsurfel),
  M(dfm_mesh, edges), M(dfm_mesh, row), M(dfm_mesh, col), M(dfm_mesh, weight), M(dfm_mesh, fixed),
  S(dfm_kin),
  M(dfm_kin, size), M(dfm_kin, stride), M(dfm_kin, t), M(dfm_kin, dt), M(dfm_kin, x), M(dfm_kin, v), M(dfm_kin, state),
  M(dfm_kin, state_out),
  S(dfm_model),
  M(dfm_model, size), M(dfm_model, caps), M(dfm_model, cells), M(dfm_model, nslot), M(dfm_model, slots), M(dfm_model, create),
  M(dfm_model, destroy), M(dfm_model, set_params), M(dfm_model, state_init), M(dfm_model, add_forces), M(dfm_model, bound),
  M(dfm_model, energy), M(dfm_model, pattern), M(dfm_model, stiffness), M(dfm_model, extension),
  S(dfm_stepper),
  M(dfm_stepper, size), M(dfm_stepper, reserved), M(dfm_stepper, predict), M(dfm_stepper, respond), M(dfm_stepper, diagonal),
  M(dfm_stepper, commit), M(dfm_stepper, fetch),
  S(dfm_solver),
  M(dfm_solver, size), M(dfm_solver, flags), M(dfm_solver, analyse), M(dfm_solver, factor), M(dfm_solver, solve),
  M(dfm_solver, release),
  S(dfm_plugin),
  M(dfm_plugin, size), M(dfm_plugin, abi), M(dfm_plugin, abi_draft), M(dfm_plugin, ntype), M(dfm_plugin, types),
  M(dfm_plugin, shutdown),
  S(dfm_contact),
  M(dfm_contact, size), M(dfm_contact, flags), M(dfm_contact, body_a), M(dfm_contact, body_b), M(dfm_contact, key),
  M(dfm_contact, feature_a), M(dfm_contact, feature_b), M(dfm_contact, kind), M(dfm_contact, law), M(dfm_contact, point),
  M(dfm_contact, normal), M(dfm_contact, tangent), M(dfm_contact, gap), M(dfm_contact, area), M(dfm_contact, fn), M(dfm_contact, ft),
  M(dfm_contact, slip), M(dfm_contact, bristle),
  S(dfm_pair_report),
  M(dfm_pair_report, size), M(dfm_pair_report, count), M(dfm_pair_report, sticking),
  M(dfm_pair_report, law), M(dfm_pair_report, a), M(dfm_pair_report, b), M(dfm_pair_report, normal),
  M(dfm_pair_report, force), M(dfm_pair_report, friction), M(dfm_pair_report, moment),
  M(dfm_pair_report, slip_max), M(dfm_pair_report, friction_work),
  S(dfm_pair_impulse),
  M(dfm_pair_impulse, size), M(dfm_pair_impulse, reserved), M(dfm_pair_impulse, a),
  M(dfm_pair_impulse, b), M(dfm_pair_impulse, impulse), M(dfm_pair_impulse, normal_impulse),
  M(dfm_pair_impulse, peak_normal), M(dfm_pair_impulse, peak_force), M(dfm_pair_impulse, point),
  M(dfm_pair_impulse, touching),
  S(dfm_contact_event),
  M(dfm_contact_event, size), M(dfm_contact_event, kind), M(dfm_contact_event, a),
  M(dfm_contact_event, b), M(dfm_contact_event, key), M(dfm_contact_event, t),
  S(dfm_overlap),
  M(dfm_overlap, size), M(dfm_overlap, flags), M(dfm_overlap, a), M(dfm_overlap, b),
  M(dfm_overlap, crossings), M(dfm_overlap, enclosed), M(dfm_overlap, depth),
  S(dfm_stage_time),
  M(dfm_stage_time, name), M(dfm_stage_time, seconds), M(dfm_stage_time, calls),
  S(dfm_rigid_state),
  M(dfm_rigid_state, position), M(dfm_rigid_state, rotation), M(dfm_rigid_state, velocity),
  M(dfm_rigid_state, spin),
  S(dfm_rigid_def),
  M(dfm_rigid_def, size), M(dfm_rigid_def, shape), M(dfm_rigid_def, name), M(dfm_rigid_def, pose),
  M(dfm_rigid_def, half_size), M(dfm_rigid_def, radius), M(dfm_rigid_def, half_length),
  M(dfm_rigid_def, mass), M(dfm_rigid_def, inertia), M(dfm_rigid_def, velocity), M(dfm_rigid_def, spin),
  M(dfm_rigid_def, fixed), M(dfm_rigid_def, category), M(dfm_rigid_def, collides_with),
  M(dfm_rigid_def, reserved), M(dfm_rigid_def, material), M(dfm_rigid_def, user),
  S(dfm_joint_def),
  M(dfm_joint_def, size), M(dfm_joint_def, type), M(dfm_joint_def, body), M(dfm_joint_def, with),
  M(dfm_joint_def, anchor), M(dfm_joint_def, axis), M(dfm_joint_def, motor), M(dfm_joint_def, reserved),
  M(dfm_joint_def, velocity), M(dfm_joint_def, max),
  S(dfm_param_value), M(dfm_param_value, key), M(dfm_param_value, value), M(dfm_param_value, width),
  S(dfm_params), M(dfm_params, size), M(dfm_params, n), M(dfm_params, values),
};
enum { kRows = sizeof rows / sizeof rows[0] };

static int compare(FILE *table) {
  char line[256], expected[256];
  int differ = 0;
  for (int i = 0; i < kRows; ++i) {
    snprintf(expected, sizeof expected, "%s,%s,%u\n", rows[i].type, rows[i].member, (unsigned)rows[i].value);
    if (!fgets(line, sizeof line, table)) strcpy(line, "nothing\n");
    if (strcmp(line, expected) != 0) printf("built %stable %s", expected, line), ++differ;
  }
  if (fgets(line, sizeof line, table)) printf("the table goes on: %s", line), ++differ;
  return differ;
}

int main(int argc, char **argv) {
  const int write = argc == 3 && strcmp(argv[1], "--write") == 0;
  FILE *table = fopen(argv[argc - 1], write ? "w" : "r");
  if (argc < 2 || !table) return fprintf(stderr, "layout: cannot open the table\n"), 2;
  int differ = 0;
  if (write)
    for (int i = 0; i < kRows; ++i) fprintf(table, "%s,%s,%u\n", rows[i].type, rows[i].member, (unsigned)rows[i].value);
  else
    differ = compare(table);
  fclose(table);
  printf("%d rows, %d differ\n", (int)kRows, differ);
  return differ != 0;
}
