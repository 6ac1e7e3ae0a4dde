/* deform/deform.h -- the whole public surface. */
#ifndef DEFORM_DEFORM_H
#define DEFORM_DEFORM_H
#include "deform/attach.h"
#include "deform/base.h"
#include "deform/body.h"
#include "deform/contact.h"
#include "deform/debug.h"
#include "deform/id.h"
#include "deform/law.h"
#include "deform/material.h"
#include "deform/math.h"
#include "deform/mesh.h"
#include "deform/model.h"
#include "deform/obstacle.h"
#include "deform/plugin.h"
#include "deform/rigid.h"
#include "deform/scene.h"
#include "deform/surface.h"
#include "deform/toi.h"
#include "deform/world.h"
#endif
