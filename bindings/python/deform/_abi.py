"""The C interface of libdeform for ctypes. Written by make_abi.py from the public headers: change
those."""
from ctypes import (Structure as _Structure, c_bool as flag, c_char_p as text,
                    c_double as f64, c_float as f32, c_int as cint, c_int32 as i32, c_size_t as usize,
                    c_uint8 as u8, c_uint32 as u32, c_uint64 as u64, c_void_p as ptr)

DFM_ABI = 1
DFM_ABI_MIN = 1
DFM_ABI_DRAFT = 0
DFM_OK = 0
DFM_DISCARD = 1
DFM_E_ARG = -1
DFM_E_NOMEM = -2
DFM_E_UNSUPPORTED = -3
DFM_E_STATE = -4
DFM_E_FATAL = -5
DFM_E_HANDLE = -6
DFM_E_IO = -7
DFM_E_FORMAT = -8
DFM_E_DIVERGED = -9
DFM_E_BUSY = -10
DFM_PARAM_INTEGER = 1
DFM_PARAM_LOG_SCALE = 2
DFM_PARAM_RUNTIME = 4
DFM_PARAM_ENUM = 8
DFM_PARAM_PER_CELL = 16
DFM_PARAM_AUTO = 32
DFM_PARAM_LIST = 64
DFM_PER_CONTACT, DFM_PER_POINT, DFM_PER_CELL, DFM_PER_EDGE, DFM_PER_INSTANCE = 1, 2, 3, 4, 5
DFM_SLOT_SCALAR, DFM_SLOT_TANGENT, DFM_SLOT_VECTOR, DFM_SLOT_ROTATION = 1, 2, 3, 4
DFM_KIND_FRICTION, DFM_KIND_MODEL, DFM_KIND_SOLVER = 1, 2, 3
DFM_NEED_FN, DFM_NEED_VT, DFM_NEED_FT_STOP, DFM_NEED_AREA, DFM_NEED_DWELL = 1, 2, 4, 8, 16
DFM_FRIC_ISOTROPIC, DFM_FRIC_PASSIVE, DFM_FRIC_JACOBIAN, DFM_FRIC_SET_VALUED, DFM_FRIC_NONE = 1, 2, 4, 8, 16
DFM_CAP_ENERGY = 1
DFM_CAP_STIFFNESS = 2
DFM_CAP_DAMPING = 4
DFM_CAP_ROTATION_INVARIANT = 16
DFM_CAP_PLAUSIBLE = 32
DFM_CAP_CONSTANT_STIFFNESS = 64
DFM_CAP_INSIDE = 128
DFM_CELL_TET, DFM_CELL_HEX8, DFM_CELL_TET10 = 8, 16, 32
DFM_SOLVER_DIRECT = 1
DFM_VERSION_MAJOR = 0
DFM_VERSION_MINOR = 1
DFM_VERSION_PATCH = 0
DFM_LOG_DEBUG, DFM_LOG_INFO, DFM_LOG_WARNING, DFM_LOG_ERROR = 0, 1, 2, 3
DFM_HANDLE_NONE = 0
DFM_HANDLE_WORLD = 1
DFM_HANDLE_BODY = 2
DFM_HANDLE_OBSTACLE = 3
DFM_HANDLE_MATERIAL = 4
DFM_HANDLE_LAW = 5
DFM_HANDLE_SCENE = 6
DFM_HANDLE_TETMESH = 7
DFM_HANDLE_TRIMESH = 8
DFM_HANDLE_RIGID = 9
DFM_HANDLE_TOOL = 10
DFM_INTEGRATOR_AUTO = 0
DFM_INTEGRATOR_SYMPLECTIC_EULER = 1
DFM_INTEGRATOR_IMPLICIT_EULER = 2
DFM_INTEGRATOR_TR_BDF2 = 3
DFM_WORLD_UNGUARDED, DFM_WORLD_UNTANGLE = 1, 2
DFM_SELF_OFF, DFM_SELF_ON, DFM_SELF_AUTO = 0, 1, 2
DFM_TROUBLE_SUBSTEPS = 1
DFM_TROUBLE_UNCONVERGED = 2
DFM_TROUBLE_NONFINITE = 4
DFM_TROUBLE_INVERTED = 8
DFM_TROUBLE_PLUGIN = 16
DFM_TROUBLE_OVERLAP = 32
DFM_TROUBLE_ENERGY = 64
DFM_TROUBLE_BUDGET = 256
DFM_TROUBLE_INTERRUPTED = 512
DFM_OVERLAP_OBSTACLE, DFM_OVERLAP_ASIDE, DFM_OVERLAP_SEPARATED = 1, 2, 4
DFM_COUPLING_BARYCENTRIC, DFM_COUPLING_MLS, DFM_COUPLING_THESIS = 0, 1, 2
DFM_FRICTION_RESTITUTION = 1
DFM_CONTACT_VERTEX_FACE, DFM_CONTACT_EDGE_EDGE, DFM_CONTACT_PRIMITIVE, DFM_CONTACT_RIGID = 0, 1, 2, 3
DFM_CONTACT_STICKING, DFM_CONTACT_BEGAN, DFM_CONTACT_EDGE_A, DFM_CONTACT_TRIANGLE_A = 1, 2, 4, 8
DFM_EVENT_BEGIN = 1
DFM_EVENT_END = 2
DFM_EVENT_RELEASE = 3
DFM_EVENT_SENSOR_BEGIN = 4
DFM_EVENT_SENSOR_END = 5
DFM_EVENT_TEAR = 6
DFM_EVENT_CUT = 7
DFM_EVENT_PIECE = 8
DFM_ATTACH_TOUCH = 1
DFM_MESH_TETS, DFM_MESH_SURFACE = 1, 2
DFM_SCENE_SNAPSHOT, DFM_SCENE_PARTIAL = 1, 2
DFM_SHAPE_PLANE = 0
DFM_SHAPE_SPHERE = 1
DFM_SHAPE_BOX = 2
DFM_SHAPE_CAPSULE = 3
DFM_SHAPE_MESH = 4
DFM_SHAPE_VOXELS = 5
DFM_SHAPE_NONE = 6
DFM_SWAP_REFUSED = 1
DFM_JOINT_HINGE, DFM_JOINT_SLIDER, DFM_JOINT_BALL, DFM_JOINT_FIXED = 0, 1, 2, 3
DFM_RIGID_AGAIN, DFM_RIGID_MOST_AGAIN = 2, 4
DFM_TOI_BISECTION, DFM_TOI_REGULA_FALSI, DFM_TOI_BRENT, DFM_TOI_CONSERVATIVE = 0, 1, 2, 3
DFM_DRAW_CONTACTS, DFM_DRAW_FORCES, DFM_DRAW_BOXES = 1, 2, 4
DFM_SHAPE_CONVEX = 7
DFM_SHAPE_POINT = 8
DFM_QUERY_EACH, DFM_QUERY_COUNT = 1, 2
DFM_QUERY_BODIES, DFM_QUERY_OBSTACLES, DFM_QUERY_RIGIDS, DFM_QUERY_SENSORS = 1, 2, 4, 8
DFM_QUERY_INSIDE = 1
DFM_CHOICE_TOUCHED = 1
DFM_CUT_ELLIPSOID, DFM_CUT_BOX, DFM_CUT_BLADE, DFM_CUT_PLANE = 0, 1, 2, 3
DFM_CUT_REMOVE, DFM_CUT_SPLIT = 0, 1
DFM_CRUMBS_STAY, DFM_CRUMBS_REMOVE = 0, 1
DFM_TOOL_SPHERE = 0
DFM_TOOL_CAPSULE = 1
DFM_TOOL_BOX = 2
DFM_TOOL_MESH = 3
DFM_TOOL_GRASPER = 4
DFM_TOOL_SCISSORS = 5
DFM_TOOL_ELLIPSOID = 6
DFM_TOOL_BLADE = 7
DFM_TOOL_PASSIVE = 1
DFM_DEVICE_VELOCITY, DFM_DEVICE_OPENING = 1, 2


class dfm_host(_Structure):
    _fields_ = [("size", u32), ("abi", u32), ("abi_draft", u32), ("abi_min", u32), ("ctx", ptr),
                ("alloc", ptr), ("release", ptr), ("scratch", ptr), ("log", ptr), ("parallel_for", ptr),
                ("extension", ptr)]


class dfm_param(_Structure):
    _fields_ = [("key", text), ("label", text), ("unit", text), ("min", f64), ("max", f64), ("def", f64),
                ("flags", u32), ("width", u32), ("names", ptr)]


class dfm_slot(_Structure):
    _fields_ = [("unit", u32), ("width", u32), ("kind", u32), ("reserved", u32)]


class dfm_slots(_Structure):
    _fields_ = [("size", u32), ("nslot", u32), ("slots", ptr), ("slot_size", u32), ("reserved", u32)]


class dfm_type(_Structure):
    _fields_ = [("size", u32), ("kind", u32), ("id", text), ("name", text), ("version", text),
                ("licence", text), ("source", text), ("params", ptr), ("nparam", u32),
                ("param_size", u32), ("effects", ptr), ("ops", ptr)]


class dfm_friction_in(_Structure):
    _fields_ = [("size", u32), ("n", u32), ("stride", u32), ("flags", u32), ("dt", f64), ("params", ptr),
                ("data", ptr), ("fn", ptr), ("vt", ptr), ("ft_stop", ptr), ("area", ptr), ("dwell", ptr),
                ("state", ptr)]


class dfm_friction_out(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("ft", ptr), ("state", ptr), ("dft_dvt", ptr),
                ("dft_dfn", ptr), ("limit", ptr), ("mode", ptr), ("stored", ptr)]


class dfm_friction(_Structure):
    _fields_ = [("size", u32), ("needs", u32), ("flags", u32), ("nslot", u32), ("slots", ptr),
                ("eval", ptr), ("check", ptr), ("prepare", ptr), ("release", ptr), ("state", ptr),
                ("slot_size", u32), ("reserved", u32), ("without", ptr)]


class dfm_mesh(_Structure):
    _fields_ = [("size", u32), ("npoint", u32), ("ncell", u32), ("cell", u32), ("rest", ptr),
                ("cells", ptr), ("mass", ptr), ("params", ptr), ("field_keys", ptr), ("fields", ptr),
                ("nedge", u32), ("nsurfel", u32), ("edges", ptr), ("row", ptr), ("col", ptr),
                ("weight", ptr), ("fixed", ptr), ("inside", ptr)]


class dfm_kin(_Structure):
    _fields_ = [("size", u32), ("stride", u32), ("t", f64), ("dt", f64), ("x", ptr), ("v", ptr),
                ("state", ptr), ("state_out", ptr)]


class dfm_model(_Structure):
    _fields_ = [("size", u32), ("caps", u32), ("cells", u32), ("nslot", u32), ("slots", ptr),
                ("create", ptr), ("destroy", ptr), ("set_params", ptr), ("state_init", ptr),
                ("add_forces", ptr), ("bound", ptr), ("energy", ptr), ("pattern", ptr),
                ("stiffness", ptr), ("extension", ptr), ("slot_size", u32), ("reserved", u32)]


class dfm_stepper(_Structure):
    _fields_ = [("size", u32), ("reserved", u32), ("predict", ptr), ("respond", ptr), ("diagonal", ptr),
                ("commit", ptr), ("fetch", ptr), ("respond_many", ptr)]


class dfm_late_points(_Structure):
    _fields_ = [("size", u32), ("reserved", u32), ("commit", ptr), ("points", ptr), ("look", ptr),
                ("sums", ptr)]


class dfm_cell_energy(_Structure):
    _fields_ = [("size", u32), ("reserved", u32), ("cell_energy", ptr)]


class dfm_cell_stress(_Structure):
    _fields_ = [("size", u32), ("reserved", u32), ("cell_stress", ptr)]


class dfm_effects(_Structure):
    _fields_ = [("size", u32), ("reserved", u32), ("active", ptr)]


class dfm_idle(_Structure):
    _fields_ = [("size", u32), ("reserved", u32), ("why", ptr)]


class dfm_limited(_Structure):
    _fields_ = [("size", u32), ("reserved", u32), ("count", ptr)]


class dfm_caps(_Structure):
    _fields_ = [("size", u32), ("reserved", u32), ("active", ptr)]


class dfm_effect_row(_Structure):
    _fields_ = [("effect", text), ("param", u32), ("reserved", u32), ("off", f64)]


class dfm_effect_rows(_Structure):
    _fields_ = [("size", u32), ("row_size", u32), ("n", u32), ("reserved", u32), ("rows", ptr)]


class dfm_fact(_Structure):
    _fields_ = [("key", text), ("label", text), ("unit", text), ("value", f64)]


class dfm_facts(_Structure):
    _fields_ = [("size", u32), ("row_size", u32), ("list", ptr)]


class dfm_solver(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("analyse", ptr), ("factor", ptr), ("solve", ptr),
                ("release", ptr)]


class dfm_plugin(_Structure):
    _fields_ = [("size", u32), ("abi", u32), ("abi_draft", u32), ("ntype", u32), ("types", ptr),
                ("shutdown", ptr)]


class dfm_context_def(_Structure):
    _fields_ = [("size", u32), ("threads", u32), ("user", ptr), ("alloc", ptr), ("release", ptr),
                ("log", ptr), ("parallel_for", ptr), ("trace_begin", ptr), ("trace_end", ptr),
                ("plugin_dir", text), ("cookie", u64)]


class dfm_param_value(_Structure):
    _fields_ = [("key", text), ("value", ptr), ("width", u32)]


class dfm_params(_Structure):
    _fields_ = [("size", u32), ("n", u32), ("values", ptr)]


class dfm_pose(_Structure):
    _fields_ = [("position", f64 * 3), ("rotation", f64 * 4)]


class dfm_aabb(_Structure):
    _fields_ = [("lo", f64 * 3), ("hi", f64 * 3)]


class dfm_pose_key(_Structure):
    _fields_ = [("t", f64), ("pose", dfm_pose)]


class dfm_vector_key(_Structure):
    _fields_ = [("t", f64), ("value", f64 * 3)]


class dfm_scale_key(_Structure):
    _fields_ = [("t", f64), ("value", f64)]


class dfm_sine(_Structure):
    _fields_ = [("amplitude", f64 * 3), ("frequency", f64), ("phase", f64)]


class dfm_world_def(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("gravity", f64 * 3), ("reserved3", i32),
                ("integrator", i32), ("contact_offset", f64), ("contact_tolerance", f64),
                ("max_sweeps", u32), ("max_passes", u32), ("max_substeps", u32), ("sleep", u32),
                ("effects", ptr), ("sleep_speed", f64), ("sleep_time", f64), ("self_contact", u32),
                ("reserved", u32), ("max_time", f64), ("max_work", u64), ("energy_watch", f64),
                ("recovery_speed", f64), ("obstacle_speed", f64), ("solver", text),
                ("solver_tolerance", f64), ("solver_iterations", u32), ("newton_iterations", u32),
                ("reserved2", u32), ("step", f64), ("cookie", u64)]


class dfm_equilibrium_def(_Structure):
    _fields_ = [("size", u32), ("load_steps", u32), ("load_from", f64), ("load_to", f64), ("time", f64),
                ("tolerance", f64), ("max_iterations", u32), ("reserved", u32), ("cookie", u64)]


class dfm_equilibrium_info(_Structure):
    _fields_ = [("size", u32), ("load_steps", u32), ("iterations", u64), ("residual", f64)]


class dfm_overlap(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("a", u64), ("b", u64), ("crossings", u32),
                ("enclosed", u32), ("depth", f64)]


class dfm_world_stats(_Structure):
    _fields_ = [("size", u32), ("threads", u32), ("steps", u64), ("substeps", u64), ("time", f64),
                ("last_substeps", u32), ("contacts", u32), ("sticking", u32), ("passes", u32),
                ("sweeps", u32), ("pairs_tested", u32), ("residual", f64), ("contacts_max", u32),
                ("passes_max", u32), ("sweeps_max", u32), ("contacts_mean", f64), ("residual_max", f64),
                ("unconverged", u64), ("guard_steps", u64), ("rebuilds", u64), ("refits", u64),
                ("inverted_max", u32), ("substeps_max", u32), ("stable_step", f64), ("asleep", u32),
                ("self_bodies", u32), ("sleep_energy", f64), ("sleep_momentum", f64 * 3),
                ("guard_solves", u64), ("guard_cuts", u64), ("guard_lost", f64), ("rigid_again", u64),
                ("work", u64), ("work_max", u64), ("cheapened", u64), ("discarded", u64),
                ("limited_max", u32), ("self_max", u32), ("energy_start", f64), ("energy_max", f64),
                ("energy_gain", f64), ("shortened", u64)]


class dfm_memory(_Structure):
    _fields_ = [("size", u32), ("reserved", u32), ("bodies", u64), ("dynamics", u64), ("obstacles", u64),
                ("detection", u64), ("contacts", u64), ("steps", u64), ("total", u64)]


class dfm_stage_time(_Structure):
    _fields_ = [("name", text), ("seconds", f64), ("calls", u64)]


class dfm_surface_def(_Structure):
    _fields_ = [("size", u32), ("coupling", i32), ("npoint", u32), ("ntriangle", u32), ("points", ptr),
                ("triangles", ptr), ("support", f64)]


class dfm_surface_groups(_Structure):
    _fields_ = [("size", u32), ("ngroup", u32), ("names", ptr), ("ntriangle", u32), ("reserved", u32),
                ("triangles", ptr), ("group", ptr)]


class dfm_cell_field(_Structure):
    _fields_ = [("key", text), ("values", ptr), ("width", u32)]


class dfm_body_def(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("name", text), ("npoint", u32), ("ntet", u32),
                ("points", ptr), ("tets", ptr), ("material", u64), ("model", text),
                ("model_params", dfm_params), ("pose", dfm_pose), ("velocity", f64 * 3),
                ("spin", f64 * 3), ("fixed", ptr), ("category", u32), ("collides_with", u32),
                ("user", ptr), ("surface", ptr), ("nfield", u32), ("fields", ptr),
                ("cell_materials", ptr), ("cell_share", ptr), ("groups", ptr), ("integrator", i32),
                ("reserved", u32), ("cookie", u64), ("mass_scaling", f64), ("cells", ptr), ("cell", u32),
                ("reserved2", u32), ("cell_inside", ptr)]


class dfm_body_info(_Structure):
    _fields_ = [("size", u32), ("npoint", u32), ("ntet", u32), ("nsurfel", u32), ("ntriangle", u32),
                ("nedge", u32), ("world", u64), ("name", text), ("model", text), ("mass", f64),
                ("rest_volume", f64), ("user", ptr), ("mass_moved", f64), ("frequency_change", f64)]


class dfm_spring_def(_Structure):
    _fields_ = [("size", u32), ("npoint", u32), ("points", ptr), ("weights", ptr), ("to", f64 * 3),
                ("keys", ptr), ("nkey", u32), ("reserved", u32), ("stiffness", f64), ("damping", f64)]


class dfm_body_measure(_Structure):
    _fields_ = [("size", u32), ("inverted", u32), ("mass", f64), ("com", f64 * 3), ("velocity", f64 * 3),
                ("momentum", f64 * 3), ("angular", f64 * 3), ("kinetic", f64), ("elastic", f64),
                ("volume", f64), ("rest_volume", f64), ("speed_max", f64), ("contact_impulse", f64 * 3)]


class dfm_friction_def(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("between", text * 2), ("law", text),
                ("params", dfm_params), ("restitution", f64)]


class dfm_contact(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("body_a", u64), ("body_b", u64), ("key", u64),
                ("feature_a", u32), ("feature_b", u32), ("kind", u32), ("law", u32), ("point", f64 * 3),
                ("normal", f64 * 3), ("tangent", f64 * 3), ("gap", f64), ("area", f64), ("fn", f64),
                ("ft", f64 * 2), ("slip", f64 * 2), ("bristle", f64 * 2)]


class dfm_law_info(_Structure):
    _fields_ = [("size", u32), ("reserved", u32), ("id", text), ("name", text), ("type", ptr),
                ("params", dfm_params)]


class dfm_pair_report(_Structure):
    _fields_ = [("size", u32), ("count", u32), ("sticking", u32), ("law", u32), ("a", u64), ("b", u64),
                ("normal", f64), ("force", f64 * 3), ("friction", f64 * 3), ("moment", f64 * 3),
                ("slip_max", f64), ("friction_work", f64)]


class dfm_pair_impulse(_Structure):
    _fields_ = [("size", u32), ("reserved", u32), ("a", u64), ("b", u64), ("impulse", f64 * 3),
                ("normal_impulse", f64), ("peak_normal", f64), ("peak_force", f64), ("point", f64 * 3),
                ("touching", f64), ("part", f64 * 8)]


class dfm_contact_event(_Structure):
    _fields_ = [("size", u32), ("kind", u32), ("a", u64), ("b", u64), ("key", u64), ("t", f64)]


class dfm_attach_def(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("to", u64), ("npoint", u32), ("nsurfel", u32),
                ("points", ptr), ("surfels", ptr), ("group", text), ("box", ptr), ("max_distance", f64),
                ("stiffness", f64), ("damping", f64), ("release", f64), ("cookie", u64)]


class dfm_attachment(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("to", u64), ("nsurfel", u32), ("reserved", u32),
                ("stiffness", f64), ("damping", f64), ("release", f64), ("point", f64 * 3),
                ("force", f64 * 3), ("moment", f64 * 3), ("impulse", f64 * 3), ("stretch", f64)]


class dfm_vertex_layout(_Structure):
    _fields_ = [("size", u32), ("stride", u32), ("position", u32), ("normal", u32), ("velocity", u32),
                ("displacement", u32), ("stick", u32), ("reserved", u32), ("origin", f64 * 3),
                ("cookie", u64)]


class dfm_tetmesh_info(_Structure):
    _fields_ = [("size", u32), ("npoint", u32), ("ntet", u32), ("ntriangle", u32), ("nedge", u32),
                ("npiece", u32), ("turned", u32), ("dropped_points", u32), ("dropped_cells", u32),
                ("flat_cells", u32), ("duplicate_points", u32), ("nonmanifold_edges", u32),
                ("overlapping_faces", u32), ("ngroup", u32), ("volume", f64), ("edge_min", f64),
                ("edge_median", f64), ("edge_max", f64), ("quality_min", f64), ("quality_mean", f64),
                ("quality_histogram", u32 * 10), ("lo", f64 * 3), ("hi", f64 * 3), ("warnings", text),
                ("wave_path", f64), ("cell", u32), ("ncell", u32)]


class dfm_trimesh_info(_Structure):
    _fields_ = [("size", u32), ("npoint", u32), ("ntriangle", u32), ("nedge", u32), ("npiece", u32),
                ("ngroup", u32), ("merged_points", u32), ("dropped_points", u32),
                ("dropped_triangles", u32), ("turned", u32), ("open_edges", u32), ("holes", u32),
                ("nonmanifold_edges", u32), ("closed", u32), ("area", f64), ("volume", f64),
                ("edge_min", f64), ("edge_median", f64), ("edge_max", f64), ("quality_min", f64),
                ("quality_mean", f64), ("quality_histogram", u32 * 10), ("lo", f64 * 3),
                ("hi", f64 * 3), ("warnings", text)]


class dfm_scene_options(_Structure):
    _fields_ = [("size", u32), ("nset", u32), ("set", ptr), ("jitter_seed", u64)]


class dfm_scene_settings(_Structure):
    _fields_ = [("size", u32), ("nprobe", u32), ("duration", f64), ("step", f64), ("every", f64),
                ("frames", flag), ("states", flag), ("nodes", flag), ("contacts", flag), ("check", flag),
                ("color", text), ("eye", f64 * 3), ("look_at", f64 * 3), ("has_camera", flag)]


class dfm_scene_write_def(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("duration", f64), ("step", f64), ("note", ptr),
                ("user", ptr), ("cookie", u64)]


class dfm_obstacle_def(_Structure):
    _fields_ = [("size", u32), ("shape", u32), ("name", text), ("pose", dfm_pose),
                ("half_size", f64 * 3), ("radius", f64), ("half_length", f64), ("nkey", u32),
                ("reserved", u32), ("keys", ptr), ("sine", dfm_sine), ("velocity_surface", f64 * 3),
                ("material", u64), ("category", u32), ("collides_with", u32), ("user", ptr),
                ("npoint", u32), ("ntriangle", u32), ("points", ptr), ("triangles", ptr), ("cells", u32),
                ("reserved2", u32), ("cookie", u64)]


class dfm_material_def(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("name", text), ("density", f64), ("young", f64),
                ("poisson", f64), ("damping_mass", f64), ("damping_stiffness", f64),
                ("extra", dfm_params), ("cookie", u64)]


class dfm_switch(_Structure):
    _fields_ = [("size", u32), ("integrator", i32), ("t", f64), ("type", text), ("params", dfm_params),
                ("max_jump", f64), ("cookie", u64)]


class dfm_model_choice(_Structure):
    _fields_ = [("size", u32), ("integrator", i32), ("type", text), ("params", dfm_params)]


class dfm_switch_rule(_Structure):
    _fields_ = [("size", u32), ("reserved", u32), ("touching", dfm_model_choice),
                ("near_by", dfm_model_choice), ("otherwise", dfm_model_choice), ("point", f64 * 3),
                ("distance", f64), ("hysteresis", f64), ("wait", f64), ("max_jump", f64),
                ("cookie", u64)]


class dfm_swap(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("body", u64), ("t", f64), ("from", text), ("to", text),
                ("elastic_before", f64), ("elastic_after", f64), ("max_jump", f64)]


class dfm_rigid_state(_Structure):
    _fields_ = [("position", f64 * 3), ("rotation", f64 * 4), ("velocity", f64 * 3), ("spin", f64 * 3)]


class dfm_rigid_def(_Structure):
    _fields_ = [("size", u32), ("shape", u32), ("name", text), ("pose", dfm_pose),
                ("half_size", f64 * 3), ("radius", f64), ("half_length", f64), ("mass", f64),
                ("inertia", f64 * 3), ("velocity", f64 * 3), ("spin", f64 * 3), ("fixed", u32),
                ("category", u32), ("collides_with", u32), ("reserved", u32), ("material", u64),
                ("user", ptr), ("cookie", u64)]


class dfm_joint_def(_Structure):
    _fields_ = [("size", u32), ("type", u32), ("body", u32), ("with", u32), ("anchor", f64 * 3),
                ("axis", f64 * 3), ("motor", u32), ("reserved", u32), ("velocity", f64), ("max", f64)]


class dfm_rigid_set_def(_Structure):
    _fields_ = [("size", u32), ("nbody", u32), ("njoint", u32), ("reserved", u32), ("bodies", ptr),
                ("joints", ptr), ("data", ptr)]


class dfm_rigid_step(_Structure):
    _fields_ = [("size", u32), ("nbody", u32), ("t", f64), ("h", f64), ("gravity", f64 * 3),
                ("state", ptr), ("extra", ptr)]


class dfm_rigid_host(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("user", ptr), ("create", ptr), ("destroy", ptr),
                ("predict", ptr), ("respond", ptr), ("commit", ptr), ("set_motor", ptr), ("joint", ptr),
                ("revise", ptr), ("push", ptr), ("may_destroy", ptr)]


class dfm_motion(_Structure):
    _fields_ = [("p0", f64 * 3), ("p1", f64 * 3)]


class dfm_toi_options(_Structure):
    _fields_ = [("size", u32), ("method", i32), ("tolerance", f64), ("min_separation", f64),
                ("max_iterations", i32)]


class dfm_query_shape(_Structure):
    _fields_ = [("size", u32), ("shape", u32), ("pose", dfm_pose), ("half_size", f64 * 3),
                ("radius", f64), ("half_length", f64), ("npoint", u32), ("flags", u32), ("points", ptr),
                ("cookie", u64)]


class dfm_query_filter(_Structure):
    _fields_ = [("size", u32), ("what", u32), ("category", u32), ("collides_with", u32), ("accept", ptr),
                ("user", ptr), ("cookie", u64), ("only", u64)]


class dfm_query_hit(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("thing", u64), ("triangle", u32), ("reserved", u32),
                ("distance", f64), ("point", f64 * 3), ("normal", f64 * 3)]


class dfm_query_hits(_Structure):
    _fields_ = [("size", u32), ("row_size", u32), ("capacity", u32), ("n", u32), ("out", ptr)]


class dfm_contact_choice(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("a", u64), ("b", u64), ("key", u64), ("kind", u32),
                ("feature_a", u32), ("feature_b", u32), ("substep", u32), ("time", f64), ("dt", f64),
                ("point", f64 * 3), ("normal", f64 * 3), ("gap", f64), ("velocity", f64 * 3),
                ("enabled", u32), ("law", u32), ("friction_scale", f64), ("surface_velocity", f64 * 3)]


class dfm_cut_def(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("shape", u32), ("how", u32), ("pose", dfm_pose),
                ("half_size", f64 * 3), ("motion", f64 * 3), ("blade", f64 * 12), ("most", u32),
                ("reserved", u32), ("cookie", u64)]


class dfm_cut_info(_Structure):
    _fields_ = [("size", u32), ("cells", u32), ("left", u32), ("points", u32), ("parts", u32),
                ("reserved", u32), ("area", f64), ("mass", f64), ("momentum", f64 * 3), ("kinetic", f64),
                ("elastic", f64), ("pieces", u32), ("reserved2", u32), ("fracture", f64),
                ("force", f64 * 3)]


class dfm_separate_def(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("least_cells", u32), ("crumbs", u32), ("cookie", u64)]


class dfm_tool_def(_Structure):
    _fields_ = [("size", u32), ("shape", u32), ("name", text), ("pose", dfm_pose),
                ("half_size", f64 * 3), ("radius", f64), ("half_length", f64), ("npoint", u32),
                ("ntriangle", u32), ("points", ptr), ("triangles", ptr), ("opening", f64),
                ("stiffness", f64), ("damping", f64), ("turn_stiffness", f64), ("turn_damping", f64),
                ("mass", f64), ("inertia", f64), ("late", f64), ("nkey", u32), ("nopening", u32),
                ("keys", ptr), ("opening_keys", ptr), ("material", u64), ("category", u32),
                ("collides_with", u32), ("user", ptr), ("flags", u32), ("reserved", u32),
                ("cookie", u64)]


class dfm_tool_state(_Structure):
    _fields_ = [("size", u32), ("nkeys", u32), ("pose", dfm_pose), ("velocity", f64 * 3),
                ("spin", f64 * 3), ("device", dfm_pose), ("opening", f64), ("time", f64), ("work", f64),
                ("port_work", f64)]


class dfm_device_sample(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("pose", dfm_pose), ("velocity", f64 * 6),
                ("opening", f64)]


class dfm_device(_Structure):
    _fields_ = [("size", u32), ("flags", u32), ("user", ptr), ("read", ptr), ("write", ptr)]
