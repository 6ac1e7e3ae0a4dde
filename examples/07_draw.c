/* Vertices for a graphics card: a soft ball falls on a floor, and each frame its vertices go into one block
 * of memory with the layout of this program, as into a mapped vertex buffer. Texture coordinates are in the
 * same vertices and are written once. Instead of a graphics card, a few lines below draw the last frame from
 * this block: light by the normals, red where contacts stick.
 *   07_draw [FILE]      a picture in the form PPM; draw.ppm where not given */
#include <deform/deform.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 256, FRAMES = 30, STEPS_PER_FRAME = 16 };
#define TRY(call)                       \
  do {                                  \
    if ((call) < 0) {                   \
      printf("%s\n", dfm_last_error()); \
      return 1;                         \
    }                                   \
  } while (0)

typedef struct { float position[3], normal[3], uv[2], stick; } Vertex;

static unsigned char picture[SIDE][SIDE][3];
static float depth[SIDE][SIDE];

/* Seen along y: x to the right, z up; 0.4 m fill the picture. */
static void project(const float p[3], float out[3]) {
  out[0] = SIDE * (0.5f + p[0] / 0.4f);
  out[1] = SIDE * (0.95f - p[2] / 0.4f);
  out[2] = p[1];
}

static void draw(const Vertex *a, const Vertex *b, const Vertex *c) {
  float p[3], q[3], r[3];
  project(a->position, p);
  project(b->position, q);
  project(c->position, r);
  const float area = (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1]);
  if (area == 0) return;
  for (int y = 0; y < SIDE; ++y)
    for (int x = 0; x < SIDE; ++x) {
      const float px = x + 0.5f, py = y + 0.5f;
      const float u = ((q[0] - px) * (r[1] - py) - (r[0] - px) * (q[1] - py)) / area;
      const float v = ((r[0] - px) * (p[1] - py) - (p[0] - px) * (r[1] - py)) / area;
      const float w = 1 - u - v;
      if (u < 0 || v < 0 || w < 0) continue;
      const float z = u * p[2] + v * q[2] + w * r[2];
      if (z >= depth[y][x]) continue; /* something nearer is there */
      depth[y][x] = z;
      const float light = 0.25f - 0.6f * (u * a->normal[1] + v * b->normal[1] + w * c->normal[1]) +
                          0.15f * (u * a->normal[2] + v * b->normal[2] + w * c->normal[2]);
      const float stick = u * a->stick + v * b->stick + w * c->stick;
      const float shade = light < 0 ? 0 : light;
      picture[y][x][0] = (unsigned char)(255 * shade);
      picture[y][x][1] = picture[y][x][2] = (unsigned char)(255 * shade * (1 - 0.8f * stick));
    }
}

int main(int argc, char **argv) {
  const char *file = argc > 1 ? argv[1] : "draw.ppm";
  const double size[3] = {0.1, 0, 0};
  dfm_context *context;
  dfm_world world;
  dfm_obstacle floor;
  dfm_mesh_handle mesh;
  dfm_body ball;
  dfm_body_def def = dfm_body_def_default();
  dfm_material_def material = dfm_material_def_default();
  dfm_obstacle_def plane = dfm_obstacle_def_default();
  dfm_mesh_info info = {.size = sizeof info};
  dfm_vertex_layout layout = dfm_vertex_layout_default();
  uint32_t nvertex = 0, ntriangle = 0, stuck = 0;
  TRY(dfm_context_create(NULL, &context));
  TRY(dfm_world_create(context, NULL, &world));
  plane.name = "floor";
  TRY(dfm_obstacle_create(world, &plane, &floor));
  TRY(dfm_mesh_make(context, "ball", size, DFM_MESH_CELLS, 1000, &mesh));
  TRY(dfm_mesh_get_info(mesh, &info));
  def.points = info.points;
  def.tets = info.tets;
  material.young = 2e4;
  material.damping_stiffness = 4e-3;
  TRY(dfm_material_create(world, &material, &def.material));
  def.npoint = info.npoint;
  def.ntet = info.ntet;
  def.pose.position[2] = 0.2;
  TRY(dfm_body_create(world, &def, &ball));

  /* index buffer, once; vertices, uv first, as a mapped buffer would hold them */
  TRY(dfm_surface_triangles(ball, 0, NULL, &ntriangle));
  uint32_t *index = malloc(3 * sizeof *index * ntriangle);
  TRY(dfm_surface_vertices(ball, NULL, 0, NULL, &nvertex));
  Vertex *vertices = calloc(nvertex, sizeof *vertices);
  if (!index || !vertices) return 1;
  TRY(dfm_surface_triangles(ball, ntriangle, index, NULL));
  for (uint32_t i = 0; i < nvertex; ++i) vertices[i].uv[0] = (float)i / (float)nvertex;

  layout.stride = sizeof(Vertex);
  layout.position = offsetof(Vertex, position);
  layout.normal = offsetof(Vertex, normal);
  layout.stick = offsetof(Vertex, stick);
  for (int frame = 0; frame < FRAMES; ++frame) {
    for (int k = 0; k < STEPS_PER_FRAME; ++k) TRY(dfm_world_step(world, 1e-3, NULL));
    TRY(dfm_surface_vertices(ball, &layout, nvertex * sizeof(Vertex), vertices, NULL));
  }

  memset(picture, 40, sizeof picture);
  for (int y = 0; y < SIDE; ++y)
    for (int x = 0; x < SIDE; ++x) depth[y][x] = 1e9f;
  for (uint32_t t = 0; t < ntriangle; ++t)
    draw(&vertices[index[3 * t]], &vertices[index[3 * t + 1]], &vertices[index[3 * t + 2]]);
  FILE *out = fopen(file, "wb");
  if (!out) return 1;
  fprintf(out, "P6 %d %d 255\n", SIDE, SIDE);
  fwrite(picture, sizeof picture, 1, out);
  fclose(out);
  for (uint32_t i = 0; i < nvertex; ++i) stuck += vertices[i].stick == 1;
  printf("%u vertices of %zu bytes, %u triangles, %u vertices stick to the floor; %s\n", nvertex,
         sizeof(Vertex), ntriangle, stuck, file);
  free(vertices);
  free(index);
  dfm_context_destroy(context);
  return 0;
}
