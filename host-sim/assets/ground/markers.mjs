// UAVs and GMTs in the map: where they are, where they have been, and their names.

import {
  BufferAttribute, BufferGeometry, Color, ConeGeometry, CylinderGeometry, Group, Line, LineBasicMaterial, Mesh, MeshLambertMaterial,
  Quaternion, SphereGeometry, Vector3,
} from './vendor/three.mjs';
import { colourOf } from './cloud.mjs';

const MOST_PLACES = 4096;
const SPACING_M = 0.25;
const MOST_LABELS = 40;

/** A line that grows. When it is full every second place goes. */
class Trail {
  constructor(material) {
    this.geometry = new BufferGeometry();
    this.geometry.setAttribute('position', new BufferAttribute(new Float32Array(3 * MOST_PLACES), 3));
    this.object = new Line(this.geometry, material);
    this.object.frustumCulled = false;
    this.count = 0;
    this.spacing = SPACING_M;
  }

  set(places) {
    this.count = 0;
    for (let k = 0; k + 2 < places.length; k += 3) this.put(places[k], places[k + 1], places[k + 2]);
  }

  go([x, y, z]) {
    const { array } = this.geometry.attributes.position;
    const at = 3 * (this.count - 1);
    if (this.count && Math.hypot(x - array[at], y - array[at + 1], z - array[at + 2]) < this.spacing) return;
    this.put(x, y, z);
  }

  put(x, y, z) {
    const attribute = this.geometry.attributes.position;
    if (this.count === MOST_PLACES) {
      this.count /= 2;
      this.spacing *= 2;
      for (let k = 0; k < this.count; k += 1) attribute.array.copyWithin(3 * k, 6 * k, 6 * k + 3);
    }
    attribute.array.set([x, y, z], 3 * this.count);
    this.count += 1;
    attribute.needsUpdate = true;
    this.geometry.setDrawRange(0, this.count);
  }
}

const CONE = new ConeGeometry(0.55, 2.2, 12);
CONE.rotateZ(-Math.PI / 2); // Nose along the body's x axis.
const ROTOR = new SphereGeometry(0.34, 10, 8);
const MAST = new CylinderGeometry(0.12, 0.4, 2.2, 10);
MAST.rotateX(Math.PI / 2);

class Uav {
  constructor(id, labels) {
    this.id = id;
    this.body = new MeshLambertMaterial();
    this.line = new LineBasicMaterial();
    this.mast = new MeshLambertMaterial();
    this.gmtLine = new LineBasicMaterial();
    this.marker = new Group();
    this.marker.add(new Mesh(CONE, this.body));
    for (const [x, y] of [[0.8, 0.8], [0.8, -0.8], [-0.8, 0.8], [-0.8, -0.8]]) {
      const rotor = new Mesh(ROTOR, this.body);
      rotor.position.set(x, y, 0);
      this.marker.add(rotor);
    }
    this.gmt = new Mesh(MAST, this.mast);
    this.marker.visible = false;
    this.gmt.visible = false;
    this.trail = new Trail(this.line);
    this.gmtTrail = new Trail(this.gmtLine);
    this.objects = [this.marker, this.gmt, this.trail.object, this.gmtTrail.object];
    this.label = document.createElement('span');
    this.gmtLabel = document.createElement('span');
    this.label.textContent = `UAV ${id}`;
    this.gmtLabel.textContent = 'GMT';
    labels.append(this.label, this.gmtLabel);
  }

  pose(pose) {
    this.marker.position.fromArray(pose.position);
    const [w, x, y, z] = pose.quaternion;
    this.marker.quaternion.copy(new Quaternion(x, y, z, w)).normalize();
    this.marker.visible = true;
    if (!pose.starting) this.trail.go(pose.position);
    if (pose.gmt) {
      this.gmt.position.fromArray(pose.gmt);
      this.gmt.visible = true;
      this.gmtTrail.go(pose.gmt);
    }
  }

  theme(dark, gmt) {
    const colour = new Color(colourOf(this.id, dark));
    for (const material of [this.body, this.line]) material.color = colour;
    for (const material of [this.mast, this.gmtLine]) material.color = gmt;
  }
}

export class Markers {
  constructor(group, labels) {
    this.group = group;
    this.labels = labels;
    this.clear();
    this.theme(false, '#7a3fb5');
  }

  clear() {
    this.group.clear();
    this.labels.replaceChildren();
    this.uavs = new Map();
  }

  uav(id) {
    let uav = this.uavs.get(id);
    if (!uav) {
      uav = new Uav(id, this.labels);
      uav.theme(this.dark, this.gmt);
      this.uavs.set(id, uav);
      this.group.add(...uav.objects);
    }
    return uav;
  }

  poses({ poses }) { for (const pose of poses) this.uav(pose.uav).pose(pose); }

  trail({ uav, whose, places }) { this.uav(uav)[whose === 'gmt' ? 'gmtTrail' : 'trail'].set(places); }

  place(id) { const uav = this.uavs.get(id); return uav?.marker.visible ? uav.marker.position : null; }

  /** Every place that a look at all must show. */
  places() {
    const places = [];
    for (const uav of this.uavs.values()) {
      if (uav.marker.visible) places.push(uav.marker.position);
      if (uav.gmt.visible) places.push(uav.gmt.position);
    }
    return places;
  }

  theme(dark, gmt) {
    this.dark = dark;
    this.gmt = new Color(gmt);
    for (const uav of this.uavs.values()) uav.theme(dark, this.gmt);
  }

  /** Keeps markers and names at a size on the screen, before a frame is drawn. */
  beforeFrame(camera, width, height) {
    const at = new Vector3();
    camera.updateMatrixWorld();
    const named = this.uavs.size <= MOST_LABELS;
    const place = (label, object, wanted) => {
      at.copy(object.position).project(camera);
      label.hidden = !(wanted && object.visible && at.z < 1);
      if (!label.hidden) {
        label.style.transform = `translate(${((at.x + 1) * width) / 2 + 12}px, ${((1 - at.y) * height) / 2 - 9}px)`;
      }
    };
    for (const uav of this.uavs.values()) {
      for (const object of [uav.marker, uav.gmt]) {
        object.scale.setScalar(Math.max(0.4, camera.position.distanceTo(object.position) * 0.013));
      }
      place(uav.label, uav.marker, named);
      // Masts of several UAVs' GMT stand at one place: one name is enough.
      place(uav.gmtLabel, uav.gmt, this.uavs.size <= 4);
    }
  }
}
