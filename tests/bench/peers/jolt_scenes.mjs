// One scene of scenes.py in Jolt (npm jolt-physics, WebAssembly): node jolt_scenes.mjs FOLDER SCENE MESH
// key=value..., prints rows of numbers, displacements z of all points at the end, and `used`: processor time
// of the steps (what scenes.told reads). FOLDER holds node_modules. Soft bodies of Jolt do not touch each other.
import {createRequire} from "node:module";
import fs from "node:fs";
import path from "node:path";

const [folder, name, mesh, ...pairs] = process.argv.slice(2);
const v = Object.fromEntries(pairs.map((p) => p.split("=")).map(([k, x]) => [k, Number(x)]));
const file = createRequire(path.join(path.resolve(folder), "x.js")).resolve("jolt-physics/wasm-compat");
const Jolt = await (await import(file)).default();

const kWalls = 0, kMoving = 1;
const settings = new Jolt.JoltSettings();
const pairFilter = new Jolt.ObjectLayerPairFilterTable(2);
pairFilter.EnableCollision(kWalls, kMoving);
const broad = new Jolt.BroadPhaseLayerInterfaceTable(2, 2);
broad.MapObjectToBroadPhaseLayer(kWalls, new Jolt.BroadPhaseLayer(0));
broad.MapObjectToBroadPhaseLayer(kMoving, new Jolt.BroadPhaseLayer(1));
settings.mObjectLayerPairFilter = pairFilter;
settings.mBroadPhaseLayerInterface = broad;
settings.mObjectVsBroadPhaseLayerFilter =
    new Jolt.ObjectVsBroadPhaseLayerFilterTable(broad, 2, pairFilter, 2);
const jolt = new Jolt.JoltInterface(settings);
const system = jolt.GetPhysicsSystem();
const bodies = system.GetBodyInterface();

const words = fs.readFileSync(mesh, "utf8").split(/\s+/).map(Number);
const npoint = words[0], ntet = words[1], points = [], tets = [];
for (let i = 0; i < npoint; ++i) points.push(words.slice(2 + 3 * i, 5 + 3 * i));
for (let i = 0; i < ntet; ++i) tets.push(words.slice(2 + 3 * npoint + 4 * i, 6 + 3 * npoint + 4 * i));

const minus = (a, b) => a.map((x, i) => x - b[i]);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const share = new Array(npoint).fill(0), edges = new Map(), faces = new Map();
for (const t of tets) {
  const [a, b, c, d] = t.map((i) => points[i]);
  const volume = Math.abs(dot(cross(minus(b, a), minus(c, a)), minus(d, a))) / 6;
  for (const i of t) share[i] += volume / 4;
  for (let i = 0; i < 4; ++i)
    for (let j = 0; j < i; ++j) {
      const key = Math.min(t[i], t[j]) * npoint + Math.max(t[i], t[j]);
      edges.set(key, (edges.get(key) || 0) + volume);
    }
  for (const f of [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]) {
    let face = f.map((i) => t[i]);
    const other = points[t[6 - f[0] - f[1] - f[2]]];
    const normal = cross(minus(points[face[1]], points[face[0]]), minus(points[face[2]], points[face[0]]));
    if (dot(normal, minus(other, points[face[0]])) > 0) face = [face[0], face[2], face[1]];
    const key = [...face].sort((a, b) => a - b).join();
    faces.has(key) ? faces.delete(key) : faces.set(key, face);
  }
}
const total = share.reduce((a, b) => a + b);

const shared = new Jolt.SoftBodySharedSettings();
const lift = v.lift;
points.forEach((p, i) => {
  const vertex = new Jolt.SoftBodySharedSettingsVertex();
  vertex.mPosition = new Jolt.Float3(...p);
  vertex.mInvMass = name === "beam" && p[0] < 1e-6 ? 0 : 1 / (v.density * share[i]);
  shared.mVertices.push_back(vertex);
});
for (const f of faces.values()) shared.AddFace(new Jolt.SoftBodySharedSettingsFace(...f, 0));
// A bar for each edge: of stiffness E V / l^2 (V: volume of the tetrahedra that share it), times `scale`, which
// the beam's sag calibrates.
for (const [key, volume] of edges) {
  const a = Math.floor(key / npoint), b = key % npoint, edge = minus(points[a], points[b]);
  const l2 = dot(edge, edge);
  shared.mEdgeConstraints.push_back(
      new Jolt.SoftBodySharedSettingsEdge(a, b, v.rigid ? 0 : l2 / (v.scale * v.young * volume)));
}
if (v.volume)
  for (const t of tets)
    shared.mVolumeConstraints.push_back(new Jolt.SoftBodySharedSettingsVolume(...t, v.rigid ? 0 : v.volume));
shared.CalculateEdgeLengths();
shared.CalculateVolumeConstraintVolumes();
shared.Optimize();

const creation = new Jolt.SoftBodyCreationSettings(shared, new Jolt.RVec3(0, 0, lift), new Jolt.Quat(0, 0, 0, 1),
                                                   kMoving);
creation.mFriction = v.mu;
if (v.iterations) creation.mNumIterations = v.iterations;
if (v.damping >= 0) creation.mLinearDamping = v.damping;
creation.mUpdatePosition = false;
creation.mMakeRotationIdentity = false;
creation.mAllowSleeping = false;
const soft = bodies.CreateSoftBody(creation);
bodies.AddBody(soft.GetID(), Jolt.EActivation_Activate);
const vertices = Jolt.castObject(soft.GetMotionProperties(), Jolt.SoftBodyMotionProperties);

function wall(half, at) {
  const made = new Jolt.BodyCreationSettings(new Jolt.BoxShape(new Jolt.Vec3(...half), 0.001),
                                             new Jolt.RVec3(...at), new Jolt.Quat(0, 0, 0, 1),
                                             Jolt.EMotionType_Kinematic, kWalls);
  made.mFriction = v.mu;
  const body = bodies.CreateBody(made);
  bodies.AddBody(body.GetID(), Jolt.EActivation_Activate);
  return body;
}
const position = (i) => {
  const p = vertices.GetVertex(i).mPosition;
  return [p.GetX(), p.GetY(), p.GetZ() + lift];
};
const center = (axis) => {
  let sum = 0;
  for (let i = 0; i < npoint; ++i) sum += share[i] * position(i)[axis];
  return sum / total;
};
const ramp = (t, a, b) => Math.min(1, Math.max(0, (t - a) / (b - a)));
const smooth = (t, a, b) => ramp(t, a, b) ** 2 * (3 - 2 * ramp(t, a, b));
const gravity = (angle) =>
    system.SetGravity(new Jolt.Vec3(9.81 * Math.sin(angle), 0, -9.81 * Math.cos(angle)));

let before = () => {}, row;
gravity(0);
if (name === "beam") {
  const tip = [v.length, v.height / 2, v.height / 2];
  let nearest = 0;
  const apart = (i) => dot(minus(points[i], tip), minus(points[i], tip));
  points.forEach((_, i) => apart(i) < apart(nearest) && (nearest = i));
  row = () => [position(nearest)[2] - points[nearest][2] - lift];
} else if (name === "slope_hold") {
  wall([0.5, 0.5, 0.05], [0, 0, -0.05]);
  before = (t) => gravity(v.angle * ramp(t, 0.2, v.tilt));
  row = () => [center(0)];
} else if (name === "gripper") {
  wall([0.5, 0.5, 0.05], [0, 0, -0.05]);
  const half = 0.01, apart = v.radius + half + 1e-4, shut = v.depth + 1e-4;
  const jaws = [-1, 1].map((side) => wall([half, 0.06, 0.03], [side * apart, 0, lift]));
  before = (t) => jaws.forEach((jaw, i) => {
    const x = (2 * i - 1) * (apart - shut * ramp(t, 0, v.close));
    const z = lift + v.rise * smooth(t, v.lift_begin, v.lift_end);
    bodies.MoveKinematic(jaw.GetID(), new Jolt.RVec3(x, 0, z), new Jolt.Quat(0, 0, 0, 1), v.step);
  });
  row = () => [center(2)];
}

let used = 0;
const out = ["row 0 " + row().join(" ")], steps = Math.round(v.end / v.step);
for (let i = 1; i <= steps; ++i) {
  before(i * v.step);
  const started = process.cpuUsage();
  jolt.Step(v.step, v.collision_steps || 1);
  const took = process.cpuUsage(started);
  used += (took.user + took.system) / 1e6;
  out.push("row " + i * v.step + " " + row().join(" "));
}
for (let i = 0; i < npoint; ++i) out.push("moved " + (position(i)[2] - points[i][2] - lift));
out.push("used " + used);
fs.writeSync(1, out.join("\n") + "\n");
process.exit(0);
