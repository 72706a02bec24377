/** What has this layer is drawn, but is no part of the mesh: no shade falls on it, and it casts no shadow. */
export const OVERLAY = 1;
