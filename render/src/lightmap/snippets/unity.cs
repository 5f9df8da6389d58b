// Shows a scene with the lightmaps that luxel baked for Unity (built-in and URP): texels hold E/π.
//
// Import scene.obj (its UVs are the lightmap's) or scene.glb by a glTF importer that keeps TEXCOORD_1 as uv2, and the EXR files as
// textures of type "Lightmap" (HDR, no mipmaps). Put this on the scene's root and fill in `maps` in the order of the pages.
using UnityEngine;

public class LuxelLightmaps : MonoBehaviour
{
    public Texture2D[] maps;

    void Start()
    {
        var data = new LightmapData[maps.Length];
        for (int page = 0; page < maps.Length; page++)
            data[page] = new LightmapData { lightmapColor = maps[page] };
        LightmapSettings.lightmapsMode = LightmapsMode.NonDirectional;
        LightmapSettings.lightmaps = data;
        foreach (var part in GetComponentsInChildren<Renderer>())
        {
            // Objects of one page need no more; for several, set the page that the manifest names for the object.
            part.lightmapIndex = 0;
            part.lightmapScaleOffset = new Vector4(1, 1, 0, 0);
        }
    }
}
